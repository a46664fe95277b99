"""The models of contact that `icha.simulate` offers: a module for each, called as the model is, with its `MODEL`."""
