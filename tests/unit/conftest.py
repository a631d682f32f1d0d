from __future__ import annotations

from hypothesis import HealthCheck, settings

from tests.support.nightly import IS_NIGHTLY, examples

# A busy machine is no fault of the code: how long an example takes is not judged.
settings.register_profile("nightly", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("quick", settings.get_profile("nightly"), max_examples=examples(100, 30))
settings.load_profile("nightly" if IS_NIGHTLY else "quick")
