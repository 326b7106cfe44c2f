"""The parameterised skill (an ELM) and its transfer to a new view."""
