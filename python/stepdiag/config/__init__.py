"""TOML to checked keys: which keys there are, what each expects, and one clear line for what is wrong with them."""
