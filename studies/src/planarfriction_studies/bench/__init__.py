"""`planarfriction bench`: what things cost, each beside a baseline measured in the same run, without compile time.

`running` lists the benchmarks and runs them, and `comparison` compares two runs; the modules beside them measure:
`whole_runs`, `steps`, `gradients`, `workflows`, and inside simulators `simulator_costs`.
The scenes of simulators, a disc whose way to rest is known, and solvers to compare with serve the experiments, too.
"""

from planarfriction_studies.bench.measurement import Measurement
from planarfriction_studies.bench.running import BENCHMARKS, run

__all__ = ["BENCHMARKS", "Measurement", "run"]
