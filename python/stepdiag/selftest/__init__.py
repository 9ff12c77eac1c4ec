"""`stepdiag selftest`: cases with a known truth, run on the user's installation.

The truth is in the folder known and comes from elsewhere: known/README.md.
"""
