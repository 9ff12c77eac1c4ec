"""One module a screen: a function from a book and a request to a page."""
