# Goes into each batch script, before the runner: what an engine needs on a node. Change it to what the site has; on Debian nodes with
# the package openmpi-bin nothing is needed.
#
#   module load openmpi/4.1

# Ranks on cores of their own do not have to give the processor away while they wait.
export OMPI_MCA_mpi_yield_when_idle=0
