// Drives a robot with the client library of Foxglove's own web app: node vendors_client.cjs ws://HOST:8765
// It needs the packages @foxglove/ws-protocol and ws; prints one line of JSON.
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");

const client = new FoxgloveClient({ ws: new WebSocket(process.argv[2], [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });
const seen = { topics: [], messages: {}, parameters: [], times: 0, status: [] };
const topics = new Map();

client.on("serverInfo", (info) => {
  seen.server = info.name;
  const id = client.advertise({ topic: "/cmd_vel", encoding: "json", schemaName: "geometry_msgs/Twist" });
  const twist = { linear: { x: 0.3, y: 0, z: 0 }, angular: { x: 0, y: 0, z: 0 } };
  client.sendMessage(id, new TextEncoder().encode(JSON.stringify(twist)));
  client.getParameters([], "all");
});
client.on("advertise", (channels) => {
  for (const channel of channels) {
    seen.topics.push(channel.topic);
    topics.set(client.subscribe(channel.id), channel.topic);
  }
});
client.on("message", ({ subscriptionId, data }) => {
  const topic = topics.get(subscriptionId);
  seen.messages[topic] = (seen.messages[topic] ?? 0) + (data.byteLength > 0 ? 1 : 0);
});
client.on("time", () => seen.times++);
client.on("status", (status) => seen.status.push(status.message));
client.on("parameterValues", ({ parameters }) => (seen.parameters = parameters.map((row) => row.name)));
client.on("error", (error) => seen.status.push(String(error)));

const enough = () => seen.times > 5 && (seen.messages["/a/pose"] ?? 0) > 3 && seen.parameters.length > 3;
const end = Date.now() + 15000;
const timer = setInterval(() => {
  if (enough() || Date.now() > end) {
    clearInterval(timer);
    console.log(JSON.stringify(seen));
    client.close();
    process.exit(enough() ? 0 : 1);
  }
}, 50);
