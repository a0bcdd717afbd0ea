"""Flat tables of parametrised plane curves that compiled code can evaluate.

The triangulator and the optimiser see a curve only as a *track*: a number k with a position for
every parameter t in [0, 1]. They split and slide boundary nodes along it and know nothing else of
curves, cells or CAD. ``fubini.curves`` writes its curves into this form.
"""

from fubini.tracks.table import NO_TRACKS, TrackBuilder, Tracks, evaluate, joined, rounded

__all__ = ["NO_TRACKS", "TrackBuilder", "Tracks", "evaluate", "joined", "rounded"]
