// SPDX-License-Identifier: Apache-2.0
// Hears a head's LaserScans and points with a third maker's RTPS, @foxglove/rtps, and decodes them by ROS's .msg texts. It prints
// the bytes that it got as lines of JSON, so that the test decides.
//
//   node rtps_subscriber.mjs ADDRESS NAMESPACE SECONDS
//
// It understands the announcements of best-effort writers alone: of reliable ones Cyclone DDS 0.10 leaves out what is the default.
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { Durability, HistoryKind, Participant, Reliability } from "@foxglove/rtps";
import { UdpSocketNode } from "@foxglove/rtps/nodejs";

const HEADER = "\n====\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n====\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const LASER_SCAN = "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\nfloat32 time_increment\n" +
  "float32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n" + HEADER;

const [address, namespace, seconds] = process.argv.slice(2);
const reader = new MessageReader(parse(LASER_SCAN, { ros2: true }));
const number = (value) => (Number.isNaN(value) ? null : Number.isFinite(value) ? value : value > 0 ? "inf" : "-inf");
const say = (line) => process.stdout.write(JSON.stringify(line) + "\n");

const participant = new Participant({ name: "judge", addresses: [address], udpSocketCreate: UdpSocketNode.Create });
participant.on("error", (error) => process.stderr.write(`${error.message}\n`));
participant.on("userData", (data) => {
  const m = reader.readMessage(data.serializedData);
  say({
    topic: `${namespace}/scan`,
    message: {
      ...m,
      header: { sec: m.header.stamp.sec, nanosec: m.header.stamp.nsec ?? m.header.stamp.nanosec, frame_id: m.header.frame_id },
      ranges: [...m.ranges].map(number),
      intensities: [...m.intensities].map(number),
    },
  });
});
await participant.start();
participant.subscribe({
  topicName: `rt${namespace}/scan`,
  typeName: "sensor_msgs::msg::dds_::LaserScan_",
  durability: Durability.Volatile,
  reliability: { kind: Reliability.BestEffort, maxBlockingTime: { sec: 0, nsec: 0 } },
  history: { kind: HistoryKind.KeepLast, depth: 100 },
});
say({ ready: true });
setTimeout(async () => {
  await participant.shutdown();
  process.exit(0);
}, 1000 * Number(seconds));
