"""One module a section of the page: what its template is to show."""
