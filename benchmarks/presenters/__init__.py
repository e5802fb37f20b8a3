"""How the layouts of a workspace are named, printed, drawn and put into a report; other packages bring their own.

>>> from benchmarks.presenters import presenter_of
>>> presenter_of("tabletop").noun
'table'
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
