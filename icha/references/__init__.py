"""What ICHA is compared with: theories of rough contact, published points and boundary elements."""
