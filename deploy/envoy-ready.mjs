// node deploy/envoy-ready.mjs HOST:PORT, the address of Envoy's own page, prints where Envoy listens for browsers. Exits with 1
// while Envoy does not listen or does not reach the server.
const admin = `http://${process.argv[2]}`;
const { listener_statuses: listeners } = await (await fetch(`${admin}/listeners?format=json`)).json();
const { cluster_statuses: clusters } = await (await fetch(`${admin}/clusters?format=json`)).json();
const hosts = clusters.find(({ name }) => name === "lpdeform").host_statuses ?? [];
const isHealthy = ({ health_status: health }) =>
  health.eds_health_status === "HEALTHY" && !health.failed_active_health_check;
const { address, port_value: port } = listeners.find(({ name }) => name === "web").local_address.socket_address;
if (!hosts.some(isHealthy)) process.exit(1);
console.log(`${address}:${port}`);
