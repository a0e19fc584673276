// SPDX-License-Identifier: Apache-2.0
// Hears a head's topics with a third maker's RTPS, @foxglove/rtps, decodes them by ROS's .msg texts and prints them as the other
// subscribers do (heard_lines.hpp), so that the test decides.
//
//   node rtps_subscriber.mjs ADDRESS NAMESPACE SECONDS
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { Durability, HistoryKind, Participant, Reliability } from "@foxglove/rtps";
import { UdpSocketNode } from "@foxglove/rtps/nodejs";

const USED = {
  "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
  "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
  "sensor_msgs/PointField": "string name\nuint32 offset\nuint8 datatype\nuint32 count",
  "sensor_msgs/RegionOfInterest": "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify",
  "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
  "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
  "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
  "geometry_msgs/TransformStamped": "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform",
  "diagnostic_msgs/KeyValue": "string key\nstring value",
  "diagnostic_msgs/DiagnosticStatus": "byte level\nstring name\nstring message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values",
};
const number = (value) => (Number.isNaN(value) ? null : Number.isFinite(value) ? value : value > 0 ? "inf" : "-inf");
const header = (m) => ({ sec: m.stamp.sec, nanosec: m.stamp.nsec ?? m.stamp.nanosec, frame_id: m.frame_id });
const xyz = ({ x, y, z }) => [x, y, z];

// Type, .msg text and how the test wants to see it.
const TOPICS = {
  scan: {
    type: "sensor_msgs::msg::dds_::LaserScan_",
    text: "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\n" +
      "float32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities",
    show: (m) => ({ ...m, header: header(m.header), ranges: [...m.ranges].map(number), intensities: [...m.intensities].map(number) }),
  },
  points: {
    type: "sensor_msgs::msg::dds_::PointCloud2_",
    text: "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\n" +
      "uint32 row_step\nuint8[] data\nbool is_dense",
    show: (m) => ({
      ...m,
      header: header(m.header),
      fields: m.fields.map((f) => [f.name, f.offset, f.datatype, f.count]),
      data: Buffer.from(m.data).toString("hex"),
    }),
  },
  camera_info: {
    type: "sensor_msgs::msg::dds_::CameraInfo_",
    text: "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\n" +
      "float64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi",
    show: (m) => ({ ...m, header: header(m.header), d: [...m.d], k: [...m.k], r: [...m.r], p: [...m.p] }),
  },
  "/tf_static": {
    type: "tf2_msgs::msg::dds_::TFMessage_",
    text: "geometry_msgs/TransformStamped[] transforms",
    show: (m) => ({
      transforms: m.transforms.map((t) => ({
        header: header(t.header),
        child: t.child_frame_id,
        translation: xyz(t.transform.translation),
        rotation: [...xyz(t.transform.rotation), t.transform.rotation.w],
      })),
    }),
  },
  "/diagnostics": {
    type: "diagnostic_msgs::msg::dds_::DiagnosticArray_",
    text: "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status",
    show: (m) => ({
      header: header(m.header),
      status: m.status.map((s) => ({ ...s, values: Object.fromEntries(s.values.map(({ key, value }) => [key, value])) })),
    }),
  },
};

const schema = (text) => Object.entries(USED).reduce((all, [name, used]) => `${all}\n${"=".repeat(80)}\nMSG: ${name}\n${used}`, text);
const say = (line) => process.stdout.write(JSON.stringify(line) + "\n");

const [address, namespace, seconds] = process.argv.slice(2);
const participant = new Participant({ name: "judge", addresses: [address], udpSocketCreate: UdpSocketNode.Create });
const topics = new Map(Object.entries(TOPICS).map(([name, topic]) => [name.startsWith("/") ? name : `${namespace}/${name}`,
  { ...topic, reader: new MessageReader(parse(schema(topic.text), { ros2: true })) }]));
participant.on("error", (error) => process.stderr.write(`${error.message}\n`));
participant.on("userData", ({ serializedData, subscription }) => {
  const name = subscription.topicName.slice("rt".length);
  const { reader, show } = topics.get(name);
  say({ topic: name, message: show(reader.readMessage(serializedData)) });
});
await participant.start();
for (const [name, { type }] of topics) {
  const isLatched = name === "/tf_static";
  const isReliable = isLatched || name === "/diagnostics";
  participant.subscribe({
    topicName: `rt${name}`,
    typeName: type,
    durability: isLatched ? Durability.TransientLocal : Durability.Volatile,
    reliability: { kind: isReliable ? Reliability.Reliable : Reliability.BestEffort, maxBlockingTime: { sec: 0, nsec: 0 } },
    history: { kind: HistoryKind.KeepLast, depth: 100 },
  });
}
say({ ready: true });
setTimeout(async () => {
  await participant.shutdown();
  process.exit(0);
}, 1000 * Number(seconds));
