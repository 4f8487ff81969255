"""Holds the manifests of this folder against schemas: `cargo xtask test packaging` runs it.

Kubernetes' own objects go by the schemas that the package kubernetes-validate brings. Those of Agones go by the facts below, which are the fields used here as
its custom resource definitions have them (install/helm/agones/templates/crds of googleforgames/agones); the pod in a fleet goes by Kubernetes' schema again.
Unknown fields are errors.
"""

import pathlib
import sys

import jsonschema
import kubernetes_validate
import yaml

KUBERNETES = "1.37"


def closed(required=(), **properties):
    return {"type": "object", "required": list(required), "properties": properties, "additionalProperties": False}


def one_of(*values):
    return {"enum": list(values)}


TEXT = {"type": "string"}
LABELS = {"type": "object", "additionalProperties": TEXT}
METADATA = closed(name=TEXT, generateName=TEXT, namespace=TEXT, labels=LABELS, annotations=LABELS)
COUNT = {"type": "integer", "minimum": 0}
PORT = {"type": "integer", "minimum": 1, "maximum": 65535}
SHARE = {"anyOf": [COUNT, {"type": "string", "pattern": "^[0-9]+%$"}]}
SCHEDULING = one_of("Packed", "Distributed")
GAME_SERVER = closed(
    required=["template"],
    container=TEXT,
    ports={
        "type": "array",
        "minItems": 1,
        "items": closed(
            name=TEXT,
            portPolicy=one_of("Dynamic", "Static", "Passthrough", "None"),
            protocol=one_of("UDP", "TCP", "TCPUDP"),
            container=TEXT,
            containerPort=PORT,
            hostPort=PORT,
        ),
    },
    health=closed(
        disabled={"type": "boolean"},
        initialDelaySeconds=COUNT,
        periodSeconds=COUNT,
        failureThreshold={"type": "integer", "minimum": 1},
    ),
    sdkServer=closed(logLevel=one_of("Error", "Info", "Debug"), grpcPort=PORT, httpPort=PORT),
    scheduling=SCHEDULING,
    template={"type": "object"},
)
AGONES = {
    "agones.dev/v1/Fleet": closed(
        required=["template"],
        replicas=COUNT,
        scheduling=SCHEDULING,
        strategy=closed(
            type=one_of("Recreate", "RollingUpdate"), rollingUpdate=closed(maxSurge=SHARE, maxUnavailable=SHARE)
        ),
        template=closed(required=["spec"], metadata=METADATA, spec=GAME_SERVER),
    ),
    "autoscaling.agones.dev/v1/FleetAutoscaler": closed(
        required=["fleetName", "policy"],
        fleetName=TEXT,
        policy=closed(
            required=["type"],
            type=one_of("Buffer"),
            buffer=closed(
                required=["maxReplicas"],
                bufferSize=SHARE,
                minReplicas=COUNT,
                maxReplicas={"type": "integer", "minimum": 1},
            ),
        ),
    ),
    "allocation.agones.dev/v1/GameServerAllocation": closed(
        scheduling=SCHEDULING,
        selectors={
            "type": "array",
            "minItems": 1,
            "items": closed(matchLabels=LABELS, gameServerState=one_of("Ready", "Allocated")),
        },
    ),
}


def check(manifest):
    kind = f"{manifest['apiVersion']}/{manifest['kind']}"
    if kind not in AGONES:
        return kubernetes_validate.validate(manifest, KUBERNETES, strict=True)
    jsonschema.validate(
        manifest, closed(["apiVersion", "kind", "metadata", "spec"], apiVersion=TEXT, kind=TEXT, metadata=METADATA, spec=AGONES[kind])
    )
    if manifest["kind"] == "Fleet":
        pod = manifest["spec"]["template"]["spec"]["template"]
        kubernetes_validate.validate({"apiVersion": "v1", "kind": "Pod", **pod}, KUBERNETES, strict=True)


def main():
    passed, failed = 0, 0
    for path in sorted(pathlib.Path(__file__).parent.glob("*.yaml")):
        for manifest in yaml.safe_load_all(path.read_text()):
            try:
                check(manifest)
                passed += 1
            except (jsonschema.ValidationError, kubernetes_validate.ValidationError, KeyError) as error:
                failed += 1
                print(f"{path.name}, {manifest.get('kind')}: {getattr(error, 'message', error)}")
    print(f"{passed} passed, {failed} failed, 0 skipped")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
