# Starts a head and a node of Ray as KubeRay does, asks both as its probes do, runs two worlds and a campaign on them;
# scripts/image runs it in the image.
set -euo pipefail
export RAY_USAGE_STATS_ENABLED=0 RAY_AUTH_MODE=disabled ROBOGLOT_INSECURE=1
work=$(mktemp -d)
ended() {
    local status=$?
    ((status == 0)) || tail -n 20 "$work"/*.log /tmp/ray/session_latest/logs/ray_client_server*.err >&2
    kill $(jobs -p) 2>/dev/null || true
    ray stop --force >/dev/null 2>&1 || true
    exit "$status"
}
trap ended EXIT

# The commands of KubeRay's pods; two nodes of one machine cannot share their agents' port.
ray start --head --port=6379 --num-cpus=0 --dashboard-host=0.0.0.0 --dashboard-agent-listen-port=52365 \
    --object-store-memory=100000000 --block >"$work/head.log" 2>&1 &
for _ in $(seq 240); do
    wget -T 2 -q -O- http://localhost:8265/api/gcs_healthz 2>/dev/null | grep -q success && break
    sleep 0.5
done
ray start --address=127.0.0.1:6379 --num-cpus=2 --dashboard-agent-listen-port=52366 --object-store-memory=100000000 \
    --block >"$work/node.log" 2>&1 &
for port in 52365 52366; do
    for _ in $(seq 240); do
        answer=$(wget -T 2 -q -O- "http://localhost:$port/api/local_raylet_healthz" 2>/dev/null || true)
        [[ $answer == *success* ]] && break
        sleep 0.5
    done
    echo "    node's agent on $port: $answer"
    [[ $answer == *success* ]]
done

printf 'registry = "%s"\n' "$work/homes.db" >"$work/world.toml"
roboglot fleet up --on ray://127.0.0.1 --worlds 2 --template "$work/world.toml" --data "$work/fleet" \
    >"$work/up.log" 2>&1 &
up=$!
for _ in $(seq 240); do
    grep -q '^ready' "$work/up.log" && break
    kill -0 "$up"
    sleep 0.5
done
roboglot fleet list --data "$work/fleet" | sed 's/^/    /'
roboglot fleet where --registry "$work/homes.db" | sed 's/^/    /'
(($(roboglot fleet list --data "$work/fleet" | grep -c ready) == 2))
wget -T 5 -q -O- http://127.10.0.2:1448/api/core/slam/v1/localization/pose | sed 's/^/    a2: /' && echo
kill "$up" && wait "$up" || true

# As the submitter of campaign.yaml does.
mkdir "$work/scenarios"
cat >"$work/scenarios/stands.yaml" <<'END'
name: it stands
given: {world: empty, body: robomaster_ep, lockstep: true}
when: [{wait: 1}]
then: [{travelled: {at_most: 0.1}}]
END
ray job submit --address=http://localhost:8265 -- \
    roboglot campaign "$work/scenarios" --seeds 4 --on auto --out "$work/out" >"$work/job.log" 2>&1
grep 'trials passed' "$work/job.log" | sed 's/^/    /'
(($(grep -c ',passed,' "$work/out/table.csv") == 4))
