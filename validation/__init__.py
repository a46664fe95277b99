"""What ICHA is held against for the pages of its documentation: closed forms, other codes, variants of the model."""
