"""One reader a format, and one for objects; `zerorate.io.formats` lists them."""
