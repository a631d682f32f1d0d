from __future__ import annotations

from hypothesis import settings

# A busy machine is no fault of the code: how long an example takes is not judged.
settings.register_profile("drivebridge", deadline=None)
settings.load_profile("drivebridge")
