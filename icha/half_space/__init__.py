"""Elastic half-space: the displacement by contact spots at each other and on a grid."""
