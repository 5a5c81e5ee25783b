"""Ways of doing a task wrong, each with its own knowledge of when that becomes dangerous, and the
safe twins that come close.
"""
