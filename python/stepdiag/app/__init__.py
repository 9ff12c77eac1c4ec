"""The application: pages in the browser of this computer, for everything that the commands do with a machine book."""
