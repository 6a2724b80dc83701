# Runs what `iceslide sweep --no-run` has prepared, on this machine or as jobs of a cluster:
#
#   snakemake -s scripts/sweep.smk --cores 2 -k --config sweep=results/DIR
#   snakemake -s scripts/sweep.smk --executor slurm --jobs 50 -k --config sweep=results/DIR ranks=4
#
# and again `iceslide sweep ... --no-run` collects the table. One more `snakemake` runs what failed.
import csv
from pathlib import Path

FOLDER = Path(config["sweep"])
RANKS = int(config.get("ranks", 1))
MINUTES, MEGABYTES = int(config.get("minutes", 60)), int(config.get("megabytes", 2000))

with open(FOLDER / "sweep.csv", newline="", encoding="utf-8") as table:
    CASES = [
        row["case"]
        for row in csv.DictReader(table)
        if row["status"] != "done" and row["model"] != "point"
    ]
SCENES = expand(str(FOLDER / "cases/{case}/scene.toml"), case=CASES)


rule all:
    input:
        expand(str(FOLDER / "cases/{case}/.ended"), case=CASES),


# Forms are compiled before the cases start, where the cases will run (for that processor).
rule forms:
    input:
        SCENES,
    output:
        temp(touch(FOLDER / ".forms")),
    resources:
        runtime=30,
        mem_mb=MEGABYTES,
    shell:
        "python -m iceslide_fem.sweep.compile_forms {input}"


rule case:
    input:
        scene=FOLDER / "cases/{case}/scene.toml",
        forms=FOLDER / ".forms",
    output:
        touch(FOLDER / "cases/{case}/.ended"),
    params:
        folder=lambda wildcards: FOLDER / "cases" / wildcards.case,
    threads: RANKS
    resources:
        mpi="mpirun",
        tasks=RANKS,
        runtime=MINUTES,
        mem_mb=MEGABYTES,
    shell:
        "export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1; "
        "how=--out; [ ! -f {params.folder}/checkpoint ] || how=--restart; "
        "{resources.mpi} -n {resources.tasks} iceslide run {input.scene} $how {params.folder} "
        "> {params.folder}/log.txt 2>&1"
