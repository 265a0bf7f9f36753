"""The experiments there are, and running some of them into one folder."""

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

from affordance.exceptions import SeeingError
from affordance.experiments import com, reach, weight
from affordance.experiments.hammer import experiment as hammer
from affordance.experiments.shared.checks import switch_faults_on
from affordance.experiments.vision import experiment as vision
from affordance.experiments.vision_comparison import compare_feature_sources
from affordance.files.atomic import remove_leftovers
from affordance.plant.arm import ARM, load_arm
from affordance.proprioception.faults import load_faults
from affordance.reporting.report import write_report
from affordance.runs.cluster import use_cluster
from affordance.runs.repeats import end_processes, prepare_folder
from affordance.vision.features import FeatureSource
from affordance.vision.pixels.failed_frames import save_frame

EXPERIMENTS = {module.NAME: module for module in (weight, com, reach, hammer, vision)}


def run_suite(
    names: Sequence[str],
    out: Path,
    *,
    models: Path,
    seed: int,
    repeats: int,
    jobs: int,
    faults: Sequence[str] = (),
    cluster: str | None = None,
    feature_source: FeatureSource = FeatureSource.FEATURES,
) -> Path:
    """Runs experiments and writes the report of all that the folder holds.

    Args:
        names: Keys of EXPERIMENTS.
        out: Folder for the results; each experiment has a subfolder of its name.
        models: Folder with arm, materials and tools.
        seed: Root of every random draw, at least 0.
        repeats: Simulated observers, at least 1.
        jobs: Processes, at least 1; of no account with a cluster.
        faults: Names of what is to be wrong, from faults.yaml of the models.
        cluster: Address of a Dask scheduler that the repeats go to; None for processes of this machine.
        feature_source: Where the features of objects come from.

    Returns: Path of the report.

    Raises:
        BadValueError: A file of the models is wrong, the folder cannot be written to, or the cluster is not fit;
            nothing was written.
        ModelFileError: The arm cannot be loaded or is not fit; nothing was written.
        SeeingError: A picture does not show what is needed; it was saved in OUT/frames.
    """
    configs = {name: EXPERIMENTS[name].load_config(models, seed, feature_source) for name in names}
    if faults:
        switched_on = load_faults(models / "faults.yaml", faults, load_arm(models / ARM.name).joint_names)
        configs = {name: switch_faults_on(config, switched_on) for name, config in configs.items()}
    try:
        with use_cluster(cluster, models) if cluster is not None else nullcontext():
            prepare_folder(out)
            folders = {name: prepare_folder(out / name) for name in names}
            remove_leftovers(out)
            for name, folder in folders.items():
                EXPERIMENTS[name].run(configs[name], folder, repeats=repeats, jobs=jobs)
                end_processes()
    except SeeingError as error:
        raise save_frame(error, prepare_folder(out) / "frames", type(error).__name__) from error
    compare_feature_sources(out)
    return write_report(out)
