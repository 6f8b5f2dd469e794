#!/bin/sh
# status.sh JOB: how a job of Slurm is, in the words of Snakemake. Jobs that the controller has forgotten are asked of the accounting, where
# there is one. A controller that does not answer says nothing about the job. One that ran short of memory may have been done all the same,
# by writing that its program was killed: its log says so.
said=$(scontrol -o show job "$1" 2>&1)
state=$(echo "$said" | sed -n 's/.*JobState=\([A-Z_]*\).*/\1/p')
case $state$said in
    *"Invalid job id"*) state=$(sacct -X -n -P -o State -j "$1" 2> /dev/null | sed 's/ .*//;q') ;;
    [A-Z]*JobState=*) ;;
    *) state=RUNNING ;;
esac
case $state in
    COMPLETED) echo success ;;
    OUT_OF_MEMORY) grep -qs '(100%) done' ".snakemake/slurm/$1.log" && echo success || echo failed ;;
    PENDING|CONFIGURING|RUNNING|COMPLETING|SUSPENDED|REQUEUED|RESIZING|STOPPED|SIGNALING|STAGE_OUT) echo running ;;
    *) echo failed ;;
esac
