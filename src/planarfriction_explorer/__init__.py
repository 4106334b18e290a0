"""The explorer: a local page on which a pressure map is drawn, a twist is dragged and friction is seen.

`state` holds what is on the screen, `pictures` and `code` are pure functions of it, and `page` alone knows
the browser: it makes a new state of every change and shows what the functions say of it.
"""
