#!/bin/bash
# A campaign as a job array on a real Slurm: two nodes on this machine, of which one dies midway. The
# merged result must be that of the same campaign flown here.
#
# usage: slurm_test.sh ORRERY_CAMPAIGN CAMPAIGN_PROGRAM [RUNS]
# Exit code 77: skipped, with the reason.
set -u
tool=$1 program=$2 runs=${3-200}

skip() { echo "skipped: $*"; exit 77; }
fail() { echo "FAILED: $*"; exit 1; }
[ "$(id -u)" = 0 ] || skip "two Slurm nodes on one machine need root"
export PATH=$PATH:/usr/sbin
for command in slurmctld slurmd sbatch scontrol munged mungekey; do
  command -v $command >/dev/null || skip "no $command; install Debian's slurm-wlm and munge"
done
id munge >/dev/null 2>&1 || skip "no user munge"

dir=$(mktemp -d /tmp/orrery_slurm_XXXXXX)
mkdir "$dir/state" "$dir/run"
chown munge "$dir/run"
chmod 755 "$dir" "$dir/run"
host=$(hostname)
munge=(--socket="$dir/run/munge.sock" --pid-file="$dir/run/munged.pid" --log-file="$dir/run/munged.log"
  --seed-file="$dir/run/munged.seed" --key-file="$dir/run/munge.key")
as_munge() { setpriv --reuid=munge --regid="$(id -g munge)" --clear-groups "$@"; }

# Only what this script has started, by its own process id.
end_cluster() {
  [ -f "$dir/slurmctld.pid" ] && scontrol shutdown >/dev/null 2>&1
  sleep 1
  for pid_file in "$dir"/slurmd.*.pid "$dir/slurmctld.pid" "$dir/run/munged.pid"; do
    [ -f "$pid_file" ] && kill "$(cat "$pid_file")" 2>/dev/null
  done
  rm -rf "$dir"
}
trap end_cluster EXIT

port=$((20000 + $$ % 20000))
cat >"$dir/slurm.conf" <<END
ClusterName=local
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$dir/run/munge.sock,cred_expire=10
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool.%n
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.%n.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.%n.log
SlurmctldPort=$port
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2,batch_sched_delay=0,default_queue_depth=1000,sched_min_interval=0
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc=$dir/jobcomp.log
MpiDefault=none
ReturnToService=2
SlurmdTimeout=120
SlurmctldTimeout=120
MinJobAge=3600
MaxArraySize=10001
MaxJobCount=20000
NodeName=n[1-2] NodeHostname=$host NodeAddr=127.0.0.1 Port=[$((port + 1))-$((port + 2))] CPUs=1 RealMemory=500
PartitionName=main Nodes=n[1-2] Default=YES MaxTime=INFINITE State=UP
END
export SLURM_CONF=$dir/slurm.conf

as_munge mungekey --create --keyfile="$dir/run/munge.key" || skip "munge gives no key"
as_munge munged "${munge[@]}" || skip "munged does not start: $(tail -1 "$dir/run/munged.log")"
slurmctld -f "$dir/slurm.conf" || skip "slurmctld does not start"
for node in n1 n2; do
  slurmd -f "$dir/slurm.conf" -N $node || skip "slurmd $node does not start"
done
for _ in $(seq 60); do
  [ "$(sinfo -h -o %T -N 2>/dev/null | grep -c idle)" = 2 ] && break
  sleep 0.5
done
[ "$(sinfo -h -o %T -N 2>/dev/null | grep -c idle)" = 2 ] ||
  skip "the nodes do not come up here: $(tail -1 "$dir/slurmctld.log")"

# Each run sleeps for 0.05 s, so that there is a midway. The local campaign is flown meanwhile.
export CAMPAIGN_RUN_MS=50
"$tool" run "$program" --filter Slow.Sleeps --runs "$runs" -j2 --out "$dir/local" >"$dir/local.log" &
local_campaign=$!
"$tool" submit --slurm "$program" --filter Slow.Sleeps --runs "$runs" --out "$dir/cluster" --chunk 1 ||
  fail "submit"
echo "queued: $(squeue -h -r | wc -l) tasks"

# Midway node n1 dies: its daemon, its step daemons and what they run.
for _ in $(seq 240); do
  done_runs=$(cat "$dir"/cluster/runs*.jsonl | wc -l)
  [ "$done_runs" -ge $((runs / 4)) ] && break
  sleep 0.25
done
daemon=$(cat "$dir/slurmd.n1.pid")
descendants() { for child in $(pgrep -P "$1"); do echo "$child"; descendants "$child"; done; }
# The step daemons of n1, and what they run.
steps_of_n1() {
  for step in $(pgrep -f "slurmstepd: \[[0-9]+\..*\]"); do
    # A step daemon has no parent any more; its spool folder tells whose it is.
    tr '\0' '\n' <"/proc/$step/environ" 2>/dev/null | grep -q "^SLURM_CONF=$dir" || continue
    ls -l "/proc/$step/cwd" "/proc/$step/fd" 2>/dev/null | grep -q "spool.n1\|slurmd.n1" || continue
    descendants "$step"
    echo "$step"
  done
}
# Held while it is looked at: amid a task, and not between two, is the runner among them.
victims=
for _ in $(seq 200); do
  victims=$(steps_of_n1)
  kill -STOP "$daemon" $victims 2>/dev/null
  runner=$(for pid in $victims; do
    [ "$(readlink "/proc/$pid/exe")" = "$(readlink -f "$tool")" ] && echo "$pid"; done)
  [ -n "$runner" ] && [ -n "$(squeue -h -r -t running -w n1)" ] && break
  kill -CONT "$daemon" $victims 2>/dev/null
  victims=
  sleep 0.1
done
[ -n "$victims" ] || fail "n1 runs nothing midway: $(squeue -r)"
done_runs=$(cat "$dir"/cluster/runs*.jsonl | wc -l)
kill -9 "$daemon" $victims
echo "node n1 killed after $done_runs runs: slurmd $daemon, and" $victims
# Slurm is told, as a health check would: it would see it after SlurmdTimeout, which is long here lest a
# busy machine is taken for a dead node.
scontrol update nodename=n1 state=down reason=killed || fail "scontrol"

for _ in $(seq 1000); do
  [ "$(squeue -h | wc -l)" = 0 ] && break
  sleep 0.5
done
squeue -h | grep -q . && fail "jobs are left after 500 s: $(squeue)"

wait $local_campaign || fail "the local campaign: $(cat "$dir/local.log")"
grep -q "Requeuing" "$dir/slurmctld.log" ||
  fail "no task was begun anew: $(tail -20 "$dir/slurmctld.log")"
cat "$dir/cluster/accept.log"
grep -q "PASSED" "$dir/cluster/accept.log" || fail "the verdict on the cluster"
for where in local cluster; do
  "$tool" report "$dir/$where" --csv "$dir/$where.csv" >/dev/null || fail "report of $where"
  # Without the columns of host time and memory, which repeat nowhere.
  awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i ~ /wall_s|cpu_s|peak_kB/) skip[i] = 1 }
    { line = ""; for (i = 1; i <= NF; i++) if (!(i in skip)) line = line "," $i; print line }' \
    "$dir/$where.csv" >"$dir/$where.results"
done
cmp "$dir/local.results" "$dir/cluster.results" || fail "the cluster's results are others"
flown=$(cat "$dir"/cluster/runs*.jsonl | wc -l)
[ "$flown" -le $((runs + 2)) ] || fail "$flown runs were flown for $runs"
echo "PASSED: $runs runs, $(ls "$dir"/cluster/runs-*of*.jsonl | wc -l) tasks, $flown flown, results as here"
