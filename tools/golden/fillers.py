"""Programs that fill the generators' own structs with the values and print the bytes that the generators' code writes."""
import math

from golden.types import BASIC


def scoped(name):
    """sensor_msgs/msg/JointState -> sensor_msgs::msg::dds_::JointState_, as the generated IDL has it"""
    package, kind, leaf = name.split("/")
    return f"{package}::{kind}::dds_::{leaf}_"


def literal(type, value):
    if type == "bool":
        return "true" if value else "false"
    if type == "string":
        plain = "".join(chr(b) if 32 <= b < 127 and b not in b'"\\?' else f"\\{b:03o}" for b in value.encode())
        return f'"{plain}"'
    if type in ("float32", "float64"):
        if math.isnan(value):
            return "NAN"
        if math.isinf(value):
            return "INFINITY" if value > 0 else "-INFINITY"
        return value.hex() + ("f" if type == "float32" else "")
    if type == "int64":
        return f"INT64_C({value})" if value > -(1 << 63) else "INT64_MIN"
    return f"UINT64_C({value})" if type == "uint64" else f"{value}u" if value >= 1 << 31 else str(value)


class CycloneFiller:
    def assign(self, place, type, value):
        return f"  {place} = {f'text({literal(type, value)})' if type == 'string' else literal(type, value)};\n"

    def member(self, place, field):
        return f"{place}.{field.name}_"

    def resize(self, place, count):
        return f"  RESIZE({place}, {count});\n"

    def at(self, place, field, index):
        return f"{place}._buffer[{index}]" if field.shape == "sequence" else f"{place}[{index}]"

    # A bounded string is an array of characters.
    def bounded_text(self, place, value):
        return f"  strcpy({place}, {literal('string', value)});\n"


class FastFiller:
    def assign(self, place, type, value):
        return f"  {place} = {literal(type, value)};\n"

    def member(self, place, field):
        return f"{place}.{field.name}_()"

    def resize(self, place, count):
        return f"  {place}.resize({count});\n"

    def at(self, place, field, index):
        return f"{place}[{index}]"

    def bounded_text(self, place, value):
        return f"  {place} = {literal('string', value)};\n"


def fill(types, filler, place, name, values):
    out = []
    for field in types.by_name[name].fields:
        here, value = filler.member(place, field), values[field.name]
        if field.shape == "sequence":
            out.append(filler.resize(here, len(value)))
        elements = [(here, value)] if field.shape == "single" else [
            (filler.at(here, field, i), each) for i, each in enumerate(value)]
        for at, each in elements:
            if field.type not in BASIC:
                out.append(fill(types, filler, at, field.type, each))
            elif field.text_bound:
                out.append(filler.bounded_text(at, each))
            else:
                out.append(filler.assign(at, field.type, each))
    return "".join(out)


CYCLONE_HEAD = """#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "dds/dds.h"
#include "dds/ddsi/ddsi_serdata.h"
%s
#define RESIZE(s, n) do { (s)._length = (s)._maximum = (n); \\
  (s)._buffer = (n) ? calloc((n), sizeof *(s)._buffer) : NULL; } while (0)
static char* text(const char* t) { return strcpy(malloc(strlen(t) + 1), t); }

static void show(dds_entity_t domain, const char* label, const dds_topic_descriptor_t* type, const void* sample) {
  dds_entity_t topic = dds_create_topic(domain, type, label, NULL, NULL);
  dds_entity_t reader = dds_create_reader(domain, topic, NULL, NULL);
  dds_entity_t writer = dds_create_writer(domain, topic, NULL, NULL);
  struct ddsi_serdata* bytes = NULL;
  dds_sample_info_t info;
  if (dds_write(writer, sample) != DDS_RETCODE_OK || dds_takecdr(reader, &bytes, 1, &info, DDS_ANY_STATE) != 1) {
    fprintf(stderr, "nothing came back: %%s\\n", label);
    exit(1);
  }
  uint32_t size = ddsi_serdata_size(bytes);
  unsigned char* all = malloc(size);
  ddsi_serdata_to_ser(bytes, 0, size, all);
  printf("%%s ", label);
  for (uint32_t i = 0; i < size; ++i) printf("%%02x", all[i]);
  putchar('\\n');
  free(all);
  ddsi_serdata_unref(bytes);
  dds_delete(reader);
  dds_delete(writer);
  dds_delete(topic);
}
"""


def cyclone_program(types, vectors):
    out = [CYCLONE_HEAD % "".join(f'#include "{package}.h"\n' for package in types.packages())]
    calls = []
    for number, (name, variant, values) in enumerate(vectors):
        c_name = scoped(name).replace("::", "_")
        out.append(f"static void fill_{number}(dds_entity_t domain) {{\n  {c_name} v;\n  memset(&v, 0, sizeof v);\n"
                   f"{fill(types, CycloneFiller(), 'v', name, values)}"
                   f'  show(domain, "{name}/{variant}", &{c_name}_desc, &v);\n}}\n')
        calls.append(f"  fill_{number}(domain);\n")
    out.append("int main(void) {\n  dds_entity_t domain = dds_create_participant(0, NULL, NULL);\n"
               f"{''.join(calls)}  return dds_delete(domain) != DDS_RETCODE_OK;\n}}\n")
    return "".join(out)


FAST_HEAD = """#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>
%s
using eprosima::fastcdr::Cdr;

template <class T>
static void show(const char* label, const char* order, const T& value, Cdr::Endianness endianness) {
  std::vector<char> memory(1 << 16, 0);  // Fast CDR leaves what it jumps over as it was
  eprosima::fastcdr::FastBuffer buffer(memory.data(), memory.size());
  Cdr cdr(buffer, endianness, Cdr::DDS_CDR);
  cdr.serialize_encapsulation();
  value.serialize(cdr);
  std::printf("%%s%%s ", label, order);
  for (std::size_t i = 0; i < cdr.getSerializedDataLength(); ++i)
    std::printf("%%02x", static_cast<unsigned char>(memory[i]));
  std::putchar('\\n');
}
template <class T>
static void show(const char* label, const T& value) {
  show(label, "", value, Cdr::LITTLE_ENDIANNESS);
  show(label, "/big", value, Cdr::BIG_ENDIANNESS);
}
"""


def fast_program(types, vectors):
    out = [FAST_HEAD % "".join(f'#include "{package}.h"\n' for package in types.packages())]
    calls = []
    for number, (name, variant, values) in enumerate(vectors):
        out.append(f"static void fill_{number}() {{\n  {scoped(name)} v;\n"
                   f"{fill(types, FastFiller(), 'v', name, values)}"
                   f'  show("{name}/{variant}", v);\n}}\n')
        calls.append(f"  fill_{number}();\n")
    out.append(f"int main() {{\n{''.join(calls)}}}\n")
    return "".join(out)
