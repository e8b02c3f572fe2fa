"""``contourslam sweep``: an experiment of many runs, on every core, or on a cluster."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.cli.console import complain, note, print_json
from contourslam.cli.interrupt import INTERRUPTED, Interrupt
from contourslam.cli.options import Flag, Json
from contourslam.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from contourslam.experiments.sweep.engine import Outcome
    from contourslam.experiments.sweep.runs import Run
    from contourslam.experiments.sweep.store import Store

_SHOWN = 10  # failed runs that are told one by one


@dataclass(frozen=True)
class Sweep:
    """Run an experiment: recordings, rooms, noise, beams, seeds, detectors and settings, every combination once.

    Each run that is over is kept at once as a row, and is not done again: the same command goes on after Ctrl-C, after
    a crash, and where the experiment has grown. A run that fails is a row with its error. Afterwards the rows are one
    table, results.parquet.

    Example: contourslam sweep examples/sweep.toml -o out/sweep
    """

    experiment: tyro.conf.Positional[Path]
    """Experiment to run (TOML)."""
    output: Annotated[str, tyro.conf.arg(aliases=["-o"], metavar="PLACE")]
    """Folder of the results, or a URL that fsspec knows, such as s3://bucket/folder."""
    jobs: int = 0
    """Processes of this machine to use; 0 for one per core."""
    scheduler: str | None = None
    """Address of a Dask scheduler whose workers are to do it, such as tcp://10.0.0.1:8786."""
    dry_run: Flag = False
    """Only say how many runs there are, and what those that are left would cost."""
    retry_failed: Flag = False
    """Also do again what failed."""
    compact: Flag = False
    """Do no run; only bring the rows there are into results.parquet, and remove the marks of runs begun."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Do what is left of the experiment, and say what failed."""
        if self.jobs < 0:
            raise ConfigError("--jobs must be 0 or more")
        from contourslam.experiments.sweep.experiment import read_experiment
        from contourslam.experiments.sweep.plan import plan
        from contourslam.experiments.sweep.rows import DONE, FAILED
        from contourslam.experiments.sweep.store import Store

        experiment = read_experiment(self.experiment)
        runs = plan(experiment)
        store = Store(self.output)
        store.check_name(experiment.name)
        there = store.status()
        for name in store.damaged[:_SHOWN]:
            note(f"{store.url}/{name} is damaged; its run counts as not done")
        over = (DONE,) if self.retry_failed else (DONE, FAILED)
        todo = [run for run in runs if there.get(run.key) not in over]
        counts = {
            "runs": len(runs),
            "done": sum(there.get(run.key) == DONE for run in runs),
            "failed": sum(there.get(run.key) == FAILED for run in runs),
        }
        if self.dry_run:
            return self._say_cost(runs, todo, counts, store)
        store.write_experiment(experiment.name, experiment.text, [run.key for run in runs])
        if self.compact:
            return self._compact(runs, store, len(todo))
        outcome = self._sweep(todo, store, counts)
        return self._report(runs, store, outcome)

    def _compact(self, runs: "Sequence[Run]", store: "Store", left: int) -> int:
        """Make the table of what there is, and say what is left."""
        from contourslam.experiments.sweep.engine import Outcome

        store.compact()
        store.remove_starts()
        code = self._report(runs, store, Outcome(0, 0, not left))
        if left:
            note(f"{left} of {len(runs)} runs are left; the same command without --compact does them")
        return code

    def _sweep(self, todo: "Sequence[Run]", store: "Store", counts: dict[str, int]) -> "Outcome":
        """Do what is left, with a bar."""
        from contourslam.experiments.parallel import Observer
        from contourslam.experiments.sweep.engine import sweep

        if counts["done"] + counts["failed"]:
            note(f"{counts['runs'] - len(todo)} of {counts['runs']} runs are there already")
        store.forget_failed(run.key for run in todo)
        with Interrupt() as interrupt, _bar(len(todo)) as bar:
            observer = Observer(lambda over, _: bar.update(over - bar.n), lambda: interrupt.requested)
            return sweep(todo, store, jobs=self.jobs, scheduler=self.scheduler, observer=observer, say=note)

    def _say_cost(self, runs: "Sequence[Run]", todo: "Sequence[Run]", counts: dict[str, int], store: "Store") -> int:
        from contourslam.experiments.sweep.cost import expected_seconds

        seconds = expected_seconds(todo, store.read().select(["room", "recording", "detector", "setting", "seconds"]))
        if self.json:
            print_json({**counts, "left": len(todo), "seconds": seconds})
            return 0
        print(f"{len(runs)} runs: {counts['done']} done, {counts['failed']} failed, {len(todo)} left")
        if todo:
            cost = "unknown before the first is done" if seconds is None else f"{_time(seconds)} on one core"
            print(f"what is left would take: {cost}")
        return 0

    def _report(self, runs: "Sequence[Run]", store: "Store", outcome: "Outcome") -> int:
        """Say what there is now, and what failed."""
        from contourslam.experiments.sweep.rows import DONE, FAILED

        if outcome.complete:
            store.compact()
        # Its own runs: another sweep may have written a further experiment meanwhile.
        table = store.rows([run.key for run in runs]).select(["status", "key", "error_type", "error"]).to_pylist()
        failed: dict[str, Any] = {row["key"]: row for row in table if row["status"] == FAILED}
        done = sum(row["status"] == DONE for row in table)
        names = {run.key: run.name for run in runs}
        if self.json:
            errors = [
                {"run": names[key], "error_type": row["error_type"], "error": row["error"]}
                for key, row in failed.items()
            ]
            counts = {"runs": len(runs), "done": done, "now": outcome.done, "failed": errors}
            print_json({"results": store.url, **counts, "complete": outcome.complete})
        else:
            print(f"{store.url}: {done} of {len(runs)} runs done, {outcome.done} of them now")
        for key, row in list(failed.items())[:_SHOWN]:
            complain(f"{names[key]}: {row['error_type']}: {row['error']}")
        if len(failed) > _SHOWN:
            complain(f"and {len(failed) - _SHOWN} more; they are rows whose status is failed")
        if not outcome.complete and not self.compact:
            complain("interrupted; what is done is kept, and the same command goes on from there")
            return INTERRUPTED
        if failed:
            note("do what failed again with --retry-failed")
        return 1 if failed else 0


def _bar(total: int) -> Any:
    """A bar with the time that is left, on a terminal."""
    from tqdm import tqdm

    return tqdm(desc="sweep", total=total, unit=" run", delay=1.0, disable=None, leave=False, smoothing=0.05)


def _time(seconds: float) -> str:
    """Say a time as people do."""
    minutes = seconds / 60.0
    return (
        f"{seconds:.0f} s" if minutes < 2.0 else f"{minutes:.0f} min" if minutes < 120.0 else f"{minutes / 60.0:.1f} h"
    )
