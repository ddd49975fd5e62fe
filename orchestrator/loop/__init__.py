"""The steps themselves: the compiled loop, what it works on, and the algorithms of groups."""
