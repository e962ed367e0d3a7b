#!/usr/bin/env python3
"""Checks the Kubernetes examples without a cluster: each field must be one of those below, of the type that the API has for it.

The lists are the part of the schemas (core/v1, apps/v1, kubeflow.org/v2beta1) that the examples use: a field that is misspelt, in the wrong
place or of the wrong type is found, what a cluster's admission would say is not. usage: check.py FILE.yaml…"""
import re
import sys

import yaml


class Wrong(Exception):
    pass


def text(value, path):
    if not isinstance(value, str):
        raise Wrong(f"{path}: {value!r} is no text")


def whole(value, path):
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise Wrong(f"{path}: {value!r} is no whole number")


def switch(value, path):
    if not isinstance(value, bool):
        raise Wrong(f"{path}: {value!r} is neither true nor false")


def matching(pattern, what):
    def check(value, path):
        text(value, path)
        if not re.fullmatch(pattern, value):
            raise Wrong(f"{path}: {value!r} is no {what}")
    return check


def one_of(*values):
    def check(value, path):
        if value not in values:
            raise Wrong(f"{path}: {value!r} is none of {', '.join(values)}")
    return check


def several(item):
    def check(value, path):
        if not isinstance(value, list) or not value:
            raise Wrong(f"{path}: is no list, or an empty one")
        for index, one in enumerate(value):
            apply(item, one, f"{path}[{index}]")
    return check


def by_name(item, names=r".+"):
    def check(value, path):
        if not isinstance(value, dict):
            raise Wrong(f"{path}: is no map")
        for name, one in value.items():
            matching(names, "name of this kind")(name, path)
            apply(item, one, f"{path}.{name}")
    return check


def apply(schema, value, path):
    """A schema is a function, or {"field": schema}; "field!" must be there."""
    if callable(schema):
        return schema(value, path)
    if not isinstance(value, dict):
        raise Wrong(f"{path}: is no object")
    known = {name.rstrip("!"): one for name, one in schema.items()}
    for name in value:
        if name not in known:
            raise Wrong(f"{path}.{name}: there is no such field here; there are {', '.join(sorted(known))}")
    for name in schema:
        if name.endswith("!") and name[:-1] not in value:
            raise Wrong(f"{path}.{name[:-1]}: is missing")
    for name, one in value.items():
        apply(known[name], one, f"{path}.{name}")


NAME = matching(r"[a-z0-9]([-a-z0-9.]{0,251}[a-z0-9])?", "name (DNS-1123)")
QUANTITY = matching(r"[0-9]+(\.[0-9]+)?(m|k|M|G|T|Ki|Mi|Gi|Ti)?", "quantity")
LABELS = by_name(text, r"([a-z0-9.-]+/)?[A-Za-z0-9]([A-Za-z0-9._-]{0,61}[A-Za-z0-9])?")
METADATA = {"name": NAME, "namespace": NAME, "labels": LABELS, "annotations": LABELS}
RESOURCES = {"requests": by_name(QUANTITY), "limits": by_name(QUANTITY)}
PROBE = {"exec": {"command!": several(text)}, "periodSeconds": whole, "timeoutSeconds": whole}
POD_SECURITY = {"runAsNonRoot": switch, "runAsUser": whole, "runAsGroup": whole, "fsGroup": whole,
                "fsGroupChangePolicy": one_of("OnRootMismatch", "Always"),
                "seccompProfile": {"type!": one_of("RuntimeDefault", "Unconfined", "Localhost")}}
CONTAINER = {"name!": NAME, "image!": text, "command": several(text), "args": several(text),
             "env": several({"name!": text, "value": text}),
             "ports": several({"name": NAME, "containerPort!": whole}), "resources": RESOURCES,
             "securityContext": {"allowPrivilegeEscalation": switch, "readOnlyRootFilesystem": switch,
                                 "capabilities": {"drop": several(text), "add": several(text)}},
             "readinessProbe": PROBE, "livenessProbe": PROBE,
             "volumeMounts": several({"name!": NAME, "mountPath!": matching(r"/.+", "path"), "readOnly": switch})}
VOLUME = {"name!": NAME, "configMap": {"name!": NAME}, "emptyDir": {"medium": one_of("Memory", ""), "sizeLimit": QUANTITY},
          "persistentVolumeClaim": {"claimName!": NAME}}
POD = {"terminationGracePeriodSeconds": whole, "automountServiceAccountToken": switch, "securityContext": POD_SECURITY,
       "containers!": several(CONTAINER), "volumes": several(VOLUME)}
CLAIM = {"accessModes!": several(one_of("ReadWriteOnce", "ReadWriteMany", "ReadOnlyMany", "ReadWriteOncePod")),
         "resources!": {"requests!": by_name(QUANTITY)}, "storageClassName": text}
TEMPLATE = {"metadata": METADATA, "spec!": POD}
REPLICAS = {"replicas": whole, "restartPolicy": one_of("Never", "OnFailure"), "template!": TEMPLATE}
HEAD = {"apiVersion!": text, "kind!": text, "metadata!": METADATA}
KINDS = {
    ("v1", "Namespace"): HEAD,
    ("v1", "ConfigMap"): HEAD | {"data": by_name(text)},
    ("v1", "Service"): HEAD | {"spec!": {"clusterIP": text, "selector": LABELS, "ports": several(
        {"name": NAME, "port!": whole, "targetPort": text})}},
    ("v1", "PersistentVolumeClaim"): HEAD | {"spec!": CLAIM},
    ("apps/v1", "StatefulSet"): HEAD | {"spec!": {
        "serviceName!": NAME, "replicas": whole, "selector!": {"matchLabels!": LABELS}, "template!": TEMPLATE,
        "volumeClaimTemplates": several({"metadata!": METADATA, "spec!": CLAIM})}},
    ("kubeflow.org/v2beta1", "MPIJob"): HEAD | {"spec!": {
        "slotsPerWorker": whole, "sshAuthMountPath": text, "mpiImplementation": one_of("OpenMPI", "Intel", "MPICH"),
        "runPolicy": {"cleanPodPolicy": one_of("None", "Running", "All"), "backoffLimit": whole},
        "mpiReplicaSpecs!": {"Launcher!": REPLICAS, "Worker": REPLICAS}}},
}


def check_joins(item, path):
    """Names within one object that must fit together."""
    spec = item.get("spec", {})
    templates = [("template", spec["template"])] if "template" in spec else []
    templates += [(name, one["template"]) for name, one in spec.get("mpiReplicaSpecs", {}).items()]
    claims = {one["metadata"]["name"] for one in spec.get("volumeClaimTemplates", [])}
    for name, template in templates:
        volumes = {one["name"] for one in template["spec"].get("volumes", [])} | claims
        for container in template["spec"]["containers"]:
            for mount in container.get("volumeMounts", []):
                if mount["name"] not in volumes:
                    raise Wrong(f"{path}.{name}: volume {mount['name']} is mounted, and there is none")
    if "selector" in spec and "matchLabels" in spec.get("selector", {}):
        labels = spec["template"].get("metadata", {}).get("labels", {})
        if not spec["selector"]["matchLabels"].items() <= labels.items():
            raise Wrong(f"{path}.selector: does not select the template's pods")


def main():
    wrong = count = 0
    for file in sys.argv[1:]:
        with open(file, encoding="utf-8") as source:
            items = [one for one in yaml.safe_load_all(source) if one]
        for item in items:
            path = f"{file}: {item.get('kind')}"
            try:
                schema = KINDS.get((item.get("apiVersion"), item.get("kind")))
                if schema is None:
                    raise Wrong(f"{path}: {item.get('apiVersion')} {item.get('kind')} is not known here")
                apply(schema, item, path)
                check_joins(item, path)
                count += 1
            except Wrong as fault:
                print(fault, file=sys.stderr)
                wrong += 1
    if wrong:
        sys.exit(1)
    print(f"kubernetes: {count} objects have only fields that exist, of the right types")


if __name__ == "__main__":
    main()
