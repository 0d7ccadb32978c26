"""What all tests share."""

from hypothesis import settings

# A kernel's first call compiles it, which takes seconds: no example has a deadline.
settings.register_profile("macromicro", deadline=None, max_examples=50)
settings.load_profile("macromicro")
