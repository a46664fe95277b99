"""Elastic half-space: displacement by contact spots, at the other spots and on a grid."""
