"""The Kubernetes manifests, the compose file and the workflow: against the schemas of their makers, and against each other and
the programs that they start. `manifests_test.py PROGRAM [TEST...]` with lpdeform-server's path."""

import copy
import importlib.util
import json
import pathlib
import re
import subprocess
import sys
import unittest

import jsonschema
import kubernetes_validate
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
KUBERNETES = ROOT / "deploy/kubernetes"
SERVER = sys.argv.pop(1)


def schema(name):
    """One of those that check-jsonschema brings along; the program itself is not needed."""
    (folder,) = importlib.util.find_spec("check_jsonschema").submodule_search_locations
    return json.loads(pathlib.Path(folder, f"builtin_schemas/vendor/{name}.json").read_text())


def check(document, name):
    jsonschema.validators.validator_for(schema(name))(schema(name)).validate(document)


def load(path):
    return yaml.safe_load(path.read_text())


KUSTOMIZATION = load(KUBERNETES / "kustomization.yaml")
OBJECTS = [one for name in KUSTOMIZATION["resources"] for one in yaml.safe_load_all((KUBERNETES / name).read_text())]
COMPOSE = load(ROOT / "deploy/compose.yaml")


def objects(kind):
    return [one for one in OBJECTS if one["kind"] == kind]


def the(kind, name):
    (found,) = [one for one in objects(kind) if one["metadata"]["name"] == name]
    return found


WORKLOADS = objects("StatefulSet") + objects("Deployment")


def pod(workload):
    return workload["spec"]["template"]["spec"]


def containers(workload):
    return pod(workload)["containers"]


def seconds_of_grace(arguments):
    (grace,) = [int(argument.split("=")[1]) for argument in arguments if argument.startswith("--grace=")]
    return grace


class Kubernetes(unittest.TestCase):
    def test_every_object_fits_its_schema(self):
        for one in OBJECTS:
            with self.subTest(kind=one["kind"], name=one["metadata"]["name"]):
                kubernetes_validate.validate(one, "1.37", strict=True)

    def test_a_misspelt_field_is_found(self):
        wrong = copy.deepcopy(the("StatefulSet", "lpdeform"))
        containers(wrong)[0]["readinesProbe"] = containers(wrong)[0].pop("readinessProbe")
        with self.assertRaises(kubernetes_validate.ValidationError):
            kubernetes_validate.validate(wrong, "1.37", strict=True)

    def test_every_file_is_applied_or_is_values_of_a_chart(self):
        files = {path.name for path in KUBERNETES.iterdir()} - {"kustomization.yaml", "prometheus-adapter.yaml"}
        self.assertEqual(files, set(KUSTOMIZATION["resources"]))

    def test_the_parts_that_operators_count_on_are_there(self):
        self.assertEqual(the("Service", "lpdeform")["spec"]["clusterIP"], "None")
        self.assertEqual(the("StatefulSet", "lpdeform")["spec"]["serviceName"], "lpdeform")
        self.assertEqual(the("HorizontalPodAutoscaler", "lpdeform")["spec"]["scaleTargetRef"]["name"], "lpdeform")

    def test_selectors_find_the_pods_of_their_name(self):
        labels = [workload["spec"]["template"]["metadata"]["labels"] for workload in WORKLOADS]
        for workload, own in zip(WORKLOADS, labels):
            self.assertEqual(workload["spec"]["selector"]["matchLabels"], own)
        for one in objects("Service"):
            self.assertIn(one["spec"]["selector"], labels)
        for one in objects("PodDisruptionBudget"):
            self.assertIn(one["spec"]["selector"]["matchLabels"], labels)

    def test_services_probes_and_policies_name_ports_that_are_open(self):
        ports = {}
        for workload in WORKLOADS:
            for container in containers(workload):
                own = {port["name"]: port["containerPort"] for port in container["ports"]}
                ports[workload["metadata"]["name"]] = own
                for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
                    for how in ("httpGet", "tcpSocket"):
                        if how in container.get(probe, {}):
                            self.assertIn(container[probe][how]["port"], own)
        for one in objects("Service"):
            for port in one["spec"]["ports"]:
                self.assertIn(port["targetPort"], ports[one["metadata"]["name"]])
        for policy in objects("NetworkPolicy"):
            own = ports.get(policy["metadata"]["name"])
            for rule in policy["spec"].get("ingress", []):
                for port in rule["ports"]:
                    self.assertIn(port["port"], own.values())
            for rule in policy["spec"].get("egress", []) if own else []:
                (to,) = rule["to"]
                target = ports[to["podSelector"]["matchLabels"]["app.kubernetes.io/name"]]
                for port in rule["ports"]:
                    self.assertIn(port["port"], target.values())

    def test_what_must_reach_what_may(self):
        """Each address in a command is a Service here, and both policies, of who calls and of who is called, let it through."""
        policies = {one["metadata"]["name"]: one["spec"] for one in objects("NetworkPolicy")}
        calls = 0
        for workload in WORKLOADS:
            caller = workload["metadata"]["name"]
            for argument in (argument for container in containers(workload) for argument in container["args"]):
                found = re.search(r"(lpdeform[a-z-]*):(\d+)$", argument)
                if not found:
                    continue
                calls += 1
                called, port = found.group(1), int(found.group(2))
                the("Service", called)
                label = {"app.kubernetes.io/name": called}
                self.assertTrue(any(to["podSelector"]["matchLabels"] == label and {"protocol": "TCP", "port": port} in rule["ports"]
                                    for rule in policies[caller]["egress"] for to in rule["to"]), (caller, called))
                self.assertTrue(any(source.get("podSelector", {}).get("matchLabels") == {"app.kubernetes.io/name": caller}
                                    for rule in policies[called]["ingress"] for source in rule.get("from", [])), (caller, called))
        self.assertEqual(calls, 2)

    def test_nothing_runs_as_root_or_writes_beside_its_volumes(self):
        for workload in WORKLOADS:
            self.assertTrue(pod(workload)["securityContext"]["runAsNonRoot"])
            self.assertFalse(pod(workload)["automountServiceAccountToken"])
            for container in containers(workload):
                context = container["securityContext"]
                self.assertTrue(context["readOnlyRootFilesystem"])
                self.assertFalse(context["allowPrivilegeEscalation"])
                self.assertEqual(context["capabilities"], {"drop": ["ALL"]})
                self.assertIn("memory", container["resources"]["limits"])

    def test_users_are_those_of_the_images(self):
        dockerfile = (ROOT / "Dockerfile").read_text()
        for name in ("lpdeform", "lpdeform-web"):
            (workload,) = [one for one in WORKLOADS if one["metadata"]["name"] == name]
            user = pod(workload)["securityContext"]["runAsUser"]
            self.assertIn(f"USER {user}:", dockerfile)

    def test_a_pod_may_drain_before_it_is_killed(self):
        workload = the("StatefulSet", "lpdeform")
        grace = seconds_of_grace(containers(workload)[0]["args"])
        self.assertGreaterEqual(pod(workload)["terminationGracePeriodSeconds"], grace + 10)

    def test_the_container_holds_more_than_the_sessions_may(self):
        (container,) = containers(the("StatefulSet", "lpdeform"))
        (sessions,) = [int(found.group(1)) for argument in container["args"] if (found := re.fullmatch(r"--max-bytes=(\d+)GiB", argument))]
        self.assertGreater(int(container["resources"]["limits"]["memory"].removesuffix("Gi")), sessions)

    def test_the_disruption_budget_leaves_replicas(self):
        for budget in objects("PodDisruptionBudget"):
            (workload,) = [one for one in WORKLOADS if one["metadata"]["name"] == budget["metadata"]["name"]]
            self.assertGreater(workload["spec"]["replicas"], budget["spec"]["maxUnavailable"])

    def test_the_autoscaler_goes_by_a_metric_that_the_adapter_makes_of_ours(self):
        (metric,) = the("HorizontalPodAutoscaler", "lpdeform")["spec"]["metrics"]
        (rule,) = load(KUBERNETES / "prometheus-adapter.yaml")["rules"]["custom"]
        self.assertEqual(metric["pods"]["metric"]["name"], rule["name"]["as"])
        series = re.match(r"(\w+)_bucket\{", rule["seriesQuery"]).group(1)
        self.assertIn(f'"{series}"', (ROOT / "server/metrics.cc").read_text())

    def test_versions_of_images_are_the_projects(self):
        version = re.search(r"VERSION (\d+\.\d+\.\d+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
        for image in KUSTOMIZATION["images"]:
            self.assertEqual(image["newTag"], version)


class Compose(unittest.TestCase):
    def test_it_fits_the_schema(self):
        check(COMPOSE, "compose-spec")

    def test_a_misspelt_field_is_found(self):
        wrong = copy.deepcopy(COMPOSE)
        wrong["services"]["server"]["depend_on"] = wrong["services"]["server"].pop("depends_on")
        with self.assertRaises(jsonschema.ValidationError):
            check(wrong, "compose-spec")

    def test_a_container_may_drain_before_it_is_killed(self):
        server = COMPOSE["services"]["server"]
        self.assertGreaterEqual(int(server["stop_grace_period"].removesuffix("s")), seconds_of_grace(server["command"]) + 10)

    def test_addresses_are_services_of_the_file(self):
        for name, service in COMPOSE["services"].items():
            for argument in service["command"]:
                found = re.search(r"(?:^|//)([a-z]\w*):\d+$", argument)
                if found:
                    self.assertIn(found.group(1), COMPOSE["services"], name)
                    shared = set(service["networks"]) & set(COMPOSE["services"][found.group(1)]["networks"])
                    self.assertTrue(shared, (name, argument))


class Workflow(unittest.TestCase):
    workflow = load(ROOT / ".github/workflows/ci.yaml")

    def test_it_fits_the_schema(self):
        # YAML 1.1 reads the key "on" as true.
        check({("on" if key is True else key): value for key, value in self.workflow.items()}, "github-workflows")

    def test_it_runs_what_every_change_has_to_pass(self):
        steps = [step.get("run") for step in self.workflow["jobs"]["tests"]["steps"]]
        command = re.search(r'/(tests/run)"(.*)', (ROOT / ".ci/run").read_text()).expand(r"\1\2")
        self.assertIn(command, steps)


class Programs(unittest.TestCase):
    def test_the_server_takes_these_options(self):
        text = subprocess.run([SERVER, "--help"], check=True, capture_output=True, text=True).stdout
        known = set(re.findall(r"--[a-z-]+", text))
        for arguments in (containers(the("StatefulSet", "lpdeform"))[0]["args"], COMPOSE["services"]["server"]["command"]):
            self.assertLessEqual({argument.split("=")[0] for argument in arguments}, known)

    def test_envoy_is_given_options_that_it_takes(self):
        text = (ROOT / "deploy/envoy-config").read_text()
        for arguments in (containers(the("Deployment", "lpdeform-web"))[0]["args"], COMPOSE["services"]["web"]["command"]):
            for option in arguments[::2]:
                self.assertIn(f"    {option}) ", text)


if __name__ == "__main__":
    unittest.main(verbosity=2)
