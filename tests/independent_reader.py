#!/usr/bin/env python3
"""Reads recordings of servosim with the MCAP project's own Python reader, which shares no code with servosim.

    pip install mcap mcap-protobuf-support foxglove-schemas-protobuf
    python tests/independent_reader.py FILE...

Checksums are checked and every message is decoded by the schema in the file. Prints what failed, then one line
`N passed, M failed`, and exits 1 if anything failed. A `.partial` file of a killed run is not whole and fails.
"""

import hashlib
import json
import sys
from collections import Counter

from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory

try:
    from foxglove_schemas_protobuf import Log_pb2, SceneUpdate_pb2
except ImportError:
    Log_pb2 = SceneUpdate_pb2 = None

SCENE = "foxglove.SceneUpdate"
TOPICS = {"/servo": "servosim.Servo", "/path": SCENE, "/trace": SCENE, "/scene": SCENE, "/log": "foxglove.Log"}

# Of runs whose drives are more than their model.
DRIVES = {"/drives": "servosim.Drives"}

# The names that a recording promises; others may be added, none renamed.
SERVO_FIELDS = {
    "time_s": None,
    "path": ["s_mm", "feed_mm_s", "accel_mm_s2", "jerk_mm_s3"],
    "x": ["command_mm", "actual_mm", "velocity_command_rad_s", "velocity_rad_s", "torque_nm", "voltage_v", "saturated"],
    "y": ["command_mm", "actual_mm", "velocity_command_rad_s", "velocity_rad_s", "torque_nm", "voltage_v", "saturated"],
    "contour_error_um": None,
    "tracking_error_um": None,
}
DRIVE = ["measured_mm", "measured_rad_s", "motor_mm", "table_mm_s", "motor_torque_nm", "ripple_nm", "friction_nm", "force_nm"]
DRIVES_FIELDS = {"time_s": None, "x": [*DRIVE, "stuck", "in_gap"], "y": [*DRIVE, "stuck", "in_gap"]}


class Checks:
    """Counts what holds and prints what does not."""

    def __init__(self):
        self.passed = self.failed = 0

    def __call__(self, what, holds, detail=""):
        if holds:
            self.passed += 1
        else:
            self.failed += 1
            print(f"FAILED {what} {detail}".rstrip())


def shape(file):
    """A descriptor without what does not matter on the wire or to a viewer."""

    def field(f):
        return (f.number, f.name, f.label, f.type, f.type_name)

    def enum(e):
        return (e.name, [(v.name, v.number) for v in e.value])

    return (
        file.package,
        file.syntax,
        sorted(file.dependency),
        [(m.name, sorted(map(field, m.field)), sorted(map(enum, m.enum_type))) for m in file.message_type],
    )


def official_files(descriptor, found=None):
    """Foxglove's own file descriptors, with all that they depend on."""
    found = {} if found is None else found
    if descriptor.name not in found:
        proto = FileDescriptorProto()
        descriptor.CopyToProto(proto)
        found[descriptor.name] = shape(proto)
        for dependency in descriptor.dependencies:
            official_files(dependency, found)
    return found


def check_descriptors(check, name, schemas):
    for schema, module in (("foxglove.SceneUpdate", SceneUpdate_pb2), ("foxglove.Log", Log_pb2)):
        if module is None:
            print("note: foxglove-schemas-protobuf is not installed; its descriptors are not compared")
            return
        ours = {f.name: shape(f) for f in FileDescriptorSet.FromString(schemas[schema].data).file}
        official = official_files(module.DESCRIPTOR)
        check(f"{name}: files of {schema}", set(ours) == set(official), set(ours) ^ set(official))
        for file in sorted(set(ours) & set(official)):
            check(f"{name}: {schema}: {file}", ours[file] == official[file], f"\n  {ours[file]}\n  {official[file]}")


def check_file(check, name):
    with open(name, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        check(f"{name}: has a summary section", summary is not None)
        if summary is None:
            return
        schemas = {schema.name: schema for schema in summary.schemas.values()}
        topics = {c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()}
        drives = not attachment_keys(reader).isdisjoint(("effects", "compensation", "remedies", "controller", "cross_coupling"))
        check(f"{name}: topics", topics == (TOPICS | DRIVES if drives else TOPICS), topics)
        check(f"{name}: protobuf", all(s.encoding == "protobuf" for s in summary.schemas.values()))
        check_descriptors(check, name, schemas)

        attachments = {a.name: a for a in reader.iter_attachments()}
        types = {key: a.media_type for key, a in attachments.items()}
        wanted = {"scenario.toml": "application/toml", "summary.json": "application/json"}
        check(f"{name}: attachments", types == wanted, types)
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        run = metadata.get("servosim.run", {})
        check(f"{name}: run facts", {"name", "scenario_sha256", "seed", "version", "units"} <= set(run), run)
        digest = hashlib.sha256(attachments["scenario.toml"].data).hexdigest()
        check(f"{name}: scenario hash", run.get("scenario_sha256") == digest)
        figures = json.loads(attachments["summary.json"].data)
        period_ns = figures["period_s"] * 1e9

        counts, errors = Counter(), Counter()
        last, samples, told, largest_um, entities = 0, 0, 0, 0.0, []
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            counts[channel.topic] += 1
            errors["log_time goes back"] += message.log_time < last
            errors["publish_time differs"] += message.publish_time != message.log_time
            last = message.log_time
            if channel.topic == "/servo":
                errors["sequence is not k"] += message.sequence != samples
                errors["log_time is not k Δt"] += abs(message.log_time - samples * period_ns) > 0.5 + 1e-9 * last
                errors["time_s is not k Δt"] += abs(decoded.time_s * 1e9 - message.log_time) > 0.5 + 1e-9 * last
                largest_um = max(largest_um, abs(decoded.contour_error_um))
                if samples == 0:
                    check_fields(check, name, decoded.DESCRIPTOR, SERVO_FIELDS)
                samples += 1
            elif channel.topic == "/drives":
                # Before the sample that it belongs to.
                errors["drive signals out of order"] += message.sequence != samples or told != samples
                errors["drive signals late"] += abs(decoded.time_s * 1e9 - message.log_time) > 0.5 + 1e-9 * last
                if told == 0:
                    check_fields(check, name, decoded.DESCRIPTOR, DRIVES_FIELDS)
                told += 1
            elif channel.topic in ("/path", "/trace", "/scene"):
                entities.extend((message.log_time, channel.topic, entity) for entity in decoded.entities)
        for what in ("log_time goes back", "publish_time differs", "sequence is not k", "log_time is not k Δt", "time_s is not k Δt", "drive signals out of order", "drive signals late"):
            check(f"{name}: {what}", errors[what] == 0, f"{errors[what]} times")
        check(f"{name}: samples", samples == figures["samples"], f"{samples}, the summary says {figures['samples']}")
        check(f"{name}: samples with drive signals", told == (samples if drives else 0), told)
        check(f"{name}: largest error", largest_um == figures["max_contour_error_um"], largest_um)
        stated = {summary.channels[i].topic: n for i, n in summary.statistics.channel_message_counts.items()}
        check(f"{name}: statistics", stated == dict(counts), (stated, dict(counts)))
        check_scene(check, name, entities)
        check(f"{name}: log has a first and a last line", counts["/log"] >= 2)

    with open(name, "rb") as stream:
        kinds = Counter(type(r).__name__ for r in StreamReader(stream, emit_chunks=True, validate_crcs=True).records)
        check(f"{name}: one header, one footer", kinds["Header"] == 1 and kinds["Footer"] == 1, kinds)
    with open(name, "rb") as stream:
        chunks = [r for r in StreamReader(stream, emit_chunks=True).records if isinstance(r, Chunk)]
        check(f"{name}: chunks carry checksums", chunks and all(c.uncompressed_crc != 0 for c in chunks))
        check(f"{name}: chunks are not compressed", all(c.compression == "" for c in chunks))


def attachment_keys(reader):
    """The keys in the headings of the scenario's tables."""
    text = "".join(a.data.decode() for a in reader.iter_attachments() if a.name == "scenario.toml")
    headings = (line.strip("[] ") for line in text.splitlines() if line.startswith("["))
    return {key for heading in headings for key in heading.split(".")}


def check_fields(check, name, descriptor, fields):
    for field, inner in fields.items():
        found = descriptor.fields_by_name.get(field)
        check(f"{name}: field {field}", found is not None)
        for part in inner or []:
            check(f"{name}: field {field}.{part}", found is not None and part in found.message_type.fields_by_name)


def check_scene(check, name, entities):
    desired = [(time, e) for time, topic, e in entities if topic == "/path"]
    check(f"{name}: the desired path, once, at t = 0", [time for time, _ in desired] == [0])
    check(f"{name}: desired path has points", all(len(line.points) > 1 for _, e in desired for line in e.lines))
    traces = [(time, e) for time, topic, e in entities if topic == "/trace"]
    check(f"{name}: whole traces replace each other", len({e.id for _, e in traces}) == 1 and len(traces) > 2)
    begins = all(e.lines[i].points[0] == traces[0][1].lines[i].points[0] for _, e in traces for i in range(2))
    check(f"{name}: every trace is from the beginning", begins)
    # What came since the last whole trace goes on where that one ends.
    joined, last = True, None
    for _, topic, entity in entities:
        if topic == "/trace":
            last = entity
        elif topic == "/scene" and last is not None:
            joined &= all(last.lines[i].points[-1] == entity.lines[i].points[0] for i in range(2))
    check(f"{name}: the newest piece joins the trace", joined)
    upright = all(line.pose.orientation.w == 1 for _, _, e in entities for line in e.lines)
    check(f"{name}: lines are not turned", upright)
    keys = {pair.key for _, e in desired for pair in e.metadata}
    check(f"{name}: units and magnification are stated", {"unit", "error_magnification"} <= keys, keys)


def main(names):
    if not names:
        print(__doc__.strip())
        return 2
    check = Checks()
    for name in names:
        try:
            check_file(check, name)
        except Exception as error:  # whatever the reader makes of a bad file is a failed check
            check(f"{name}: read", False, f"{type(error).__name__}: {error}")
    print(f"{check.passed} passed, {check.failed} failed")
    return 1 if check.failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
