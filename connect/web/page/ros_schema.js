// SPDX-License-Identifier: Apache-2.0
// The text of a ROS 2 message (.msg, those that it uses after it) as a list of its fields.

/**
 * @typedef {{name: string, type: string, parts: Field[] | null, isSequence: boolean, length: number}} Field
 *   `parts` of a message in the message; `length` of an array with a fixed one, else 0.
 */

const FIELD = /^(\S+)\s+([A-Za-z]\w*)(\s*=.*)?$/;
const TYPE = /^([\w/]+)(?:<=\d+)?(?:\[(<=)?(\d*)\])?$/;

/** @param {string} text @returns {string[]} */
const linesOf = (text) =>
  text
    .split("\n")
    .map((line) => line.replace(/#.*/, "").trim())
    .filter((line) => line !== "");

/**
 * @param {string} line @param {Map<string, string[]>} others messages by "package/Name" and by "Name"
 * @returns {Field | null} null of a constant
 */
function fieldOf(line, others) {
  const field = FIELD.exec(line);
  const type = field && TYPE.exec(field[1]);
  if (!type) throw new Error(`'${line}' is no field of a message`);
  if (field[3]) return null;
  const name = type[1].replace("/msg/", "/");
  const used = others.get(name);
  return {
    name: field[2],
    type: name,
    parts: used ? fieldsOf(used, others) : null,
    isSequence: type[3] !== undefined && (type[3] === "" || type[2] !== undefined),
    length: type[2] === undefined ? Number(type[3] ?? 0) : 0,
  };
}

/** @param {string[]} lines @param {Map<string, string[]>} others @returns {Field[]} */
function fieldsOf(lines, others) {
  return /** @type {Field[]} */ (lines.map((line) => fieldOf(line, others)).filter((field) => field !== null));
}

/** @param {string} text a channel's schema, `ros2msg` @returns {Field[]} */
export function parseSchema(text) {
  const [first, ...rest] = text.split(/^=+$/m).map(linesOf);
  /** @type {Map<string, string[]>} */
  const others = new Map();
  for (const [head, ...lines] of rest) {
    const name = head.replace("MSG: ", "").replace("/msg/", "/");
    others.set(name, lines);
    others.set(name.slice(name.indexOf("/") + 1), lines);
  }
  return fieldsOf(first, others);
}
