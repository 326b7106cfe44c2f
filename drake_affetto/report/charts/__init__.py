"""One module a group of charts: plotly figures from results."""
