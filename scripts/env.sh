# Sourced by the other scripts after scripts/setup: the environment's programs come first, and
# Open MPI may run as root and with more ranks than cores.
venv=.venv
[ -x .venv/bin/iceslide ] || venv=.venv-pip
export PATH="$PWD/$venv/bin:$PATH"
export OMP_NUM_THREADS=1
unset PYTHONDONTWRITEBYTECODE # else every process compiles a thousand modules anew
# OpenBLAS knows processors by name: on one newer than itself it goes back to kernels without AVX.
if [ -z "${OPENBLAS_CORETYPE:-}" ] && grep -qm1 avx512vl /proc/cpuinfo 2>/dev/null; then
    export OPENBLAS_CORETYPE=SkylakeX
fi
export OMPI_MCA_rmaps_base_oversubscribe=1
export OMPI_MCA_hwloc_base_binding_policy=none # two runs at once would share the first cores
# The same for Open MPI 5.
export PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe PRTE_MCA_hwloc_default_binding_policy=none
export HWLOC_HIDE_ERRORS=2 # of a container without /sys, for mpirun itself
if [ "$(id -u)" = 0 ]; then
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi
