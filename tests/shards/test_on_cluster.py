"""Requirements of a cluster from outside: the extra, and Kubernetes' manifests in deploy/kuberay."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Annotated

import msgspec
import pytest
import yaml
from typer.testing import CliRunner

from roboglot.cli.campaign import command as campaign
from roboglot.cli.fleet import app

KUBERAY = Path(__file__).parents[2] / "deploy/kuberay"
USER = 1000  # in deploy/Containerfile
LOCK = KUBERAY.parents[1] / "requirements/fleet.lock"


class Part(msgspec.Struct, forbid_unknown_fields=True, rename="camel"):
    """The fields of KubeRay's and Kubernetes' types that the manifests may use; any other is a mistake."""


class Metadata(Part):
    name: str


class Key(Part):
    name: str
    key: str


class Source(Part):
    secret_key_ref: Key


class Variable(Part):
    name: str
    value: str = ""
    value_from: Source | None = None


class Port(Part):
    container_port: int
    name: str


class Amount(Part):
    cpu: Annotated[str, msgspec.Meta(pattern=r"^[0-9]+(\.[0-9]+|m)?$")]
    memory: Annotated[str, msgspec.Meta(pattern="^[0-9]+[KMGT]i$")]


class Resources(Part):
    requests: Amount
    limits: Amount


class Mount(Part):
    name: str
    mount_path: str


class Container(Part):
    name: str
    image: str
    resources: Resources
    env: list[Variable] = []
    ports: list[Port] = []
    volume_mounts: list[Mount] = []


class Claim(Part):
    claim_name: str


class Volume(Part):
    name: str
    persistent_volume_claim: Claim


class Security(Part):
    run_as_non_root: bool
    fs_group: int = 0


class PodSpec(Part):
    containers: list[Container]
    security_context: Security
    volumes: list[Volume] = []


class Pod(Part):
    spec: PodSpec


class Start(Part, rename="kebab"):
    """Options of `ray start`, all of them texts."""

    num_cpus: str = ""
    dashboard_host: str = ""


class Head(Part):
    ray_start_params: Start
    template: Pod


class Workers(Head):
    group_name: str
    replicas: int
    min_replicas: int
    max_replicas: int


class Cluster(Part):
    ray_version: str
    head_group_spec: Head
    worker_group_specs: list[Workers]


class Job(Part):
    entrypoint: str
    shutdown_after_job_finishes: bool
    ttl_seconds_after_finished: int
    backoff_limit: int
    ray_cluster_spec: Cluster


class RayCluster(Part, tag_field="kind"):
    api_version: str
    metadata: Metadata
    spec: Cluster


class RayJob(Part, tag_field="kind"):
    api_version: str
    metadata: Metadata
    spec: Job


def manifest(text: str) -> RayCluster | RayJob:
    return msgspec.convert(yaml.safe_load(text), type=RayCluster | RayJob)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("workerGroupSpecs:", "workerGroupSpec:"),
        ("maxReplicas: 50", 'maxReplicas: "fifty"'),
        ("dashboard-host:", "dashboard-hots:"),
        ('num-cpus: "0"', "num-cpus: 0"),
        ("memory: 4Gi", "memory: 4GB"),
        ('cpu: "2"', "cpu: 2"),
        ("containerPort: 6379", "port: 6379"),
        ("containers:", "container:"),
        ("runAsNonRoot: true", 'runAsNonRoot: "true"'),
        ("kind: RayCluster", "kind: RayClusters"),
    ],
)
def test_mistake_in_a_manifest_is_found(right: str, wrong: str) -> None:
    text = (KUBERAY / "fleet.yaml").read_text()
    assert right in text
    with pytest.raises(msgspec.ValidationError):
        manifest(text.replace(right, wrong))


def check_containers(pod: PodSpec) -> None:
    """Containers have all volumes, resources for good, and secrets from Kubernetes only."""
    volumes = {volume.name for volume in pod.volumes}
    for container in pod.containers:
        assert {mount.name for mount in container.volume_mounts} == volumes
        assert not volumes or pod.security_context.fs_group == USER, "the volume is root's"
        assert container.resources.requests == container.resources.limits, "it may be evicted"
        secret = [variable for variable in container.env if re.search("DATABASE|REGISTRY|TOKEN", variable.name)]
        assert all(variable.value_from and not variable.value for variable in secret)
        assert {"RAY_USAGE_STATS_ENABLED"} <= {variable.name for variable in container.env}


@pytest.mark.parametrize("name", ["fleet.yaml", "campaign.yaml"])
def test_manifest_has_only_known_fields_and_locked_ray(name: str) -> None:
    document = manifest((KUBERAY / name).read_text())
    cluster = document.spec if isinstance(document, RayCluster) else document.spec.ray_cluster_spec
    assert document.api_version == "ray.io/v1"
    assert re.fullmatch("[a-z]([-a-z0-9]{0,45}[a-z0-9])?", document.metadata.name)  # the operator's rule
    locked = re.search(r"^ray==([\d.]+)", LOCK.read_text(), re.MULTILINE)
    assert locked
    assert cluster.ray_version == locked[1]
    assert cluster.head_group_spec.ray_start_params.num_cpus == "0"
    for group in (cluster.head_group_spec, *cluster.worker_group_specs):
        check_containers(group.template.spec)
    if isinstance(document, RayJob):
        from typer import Typer
        from typer.main import get_command

        whole = Typer()
        whole.command()(campaign)
        words = document.spec.entrypoint.split()
        options = {option for parameter in get_command(whole).params for option in parameter.opts}
        assert words[:2] == ["roboglot", "campaign"]
        assert {word for word in words if word.startswith("--")} <= options


@pytest.mark.parametrize("name", ["fleet.yaml", "campaign.yaml"])
def test_kubernetes_own_schema_takes_a_manifests_pods(name: str) -> None:
    """Validate by kubernetes-validate (22 MB, so not among the tools): no unknown field, no wrong type."""
    kubernetes = pytest.importorskip("kubernetes_validate", reason="the package kubernetes-validate is not installed")
    spec = yaml.safe_load((KUBERAY / name).read_text())["spec"]
    cluster = spec.get("rayClusterSpec", spec)
    for group in (cluster["headGroupSpec"], *cluster["workerGroupSpecs"]):
        pod = {"apiVersion": "v1", "kind": "Pod", "metadata": {"name": "checked"}, **group["template"]}
        kubernetes.validate(pod, "1.34", strict=True)
        pod["spec"]["containers"][0]["imagee"] = "roboglot"
        with pytest.raises(kubernetes.ValidationError, match="imagee"):
            kubernetes.validate(pod, "1.34", strict=True)


def test_without_ray_extra_is_named_in_one_sentence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    for module in ("cluster", "joining"):
        monkeypatch.delitem(sys.modules, f"roboglot.shards.{module}", raising=False)
    done = CliRunner().invoke(app, ["up", "--worlds", "1", "--on", "local", "--data", str(tmp_path)])
    assert str(done.exception) == (
        "roboglot fleet: --on needs ray, which is not installed: pip install 'roboglot[fleet]'"
    )
