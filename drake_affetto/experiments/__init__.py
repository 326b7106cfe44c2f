"""The paper's experiments on the station, one module each."""
