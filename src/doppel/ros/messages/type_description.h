#pragma once
// A message type as data: its fields in order. YAML, JSON and schema text are implemented once for all types
// by this description.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/export.h"
#include "doppel/ros/messages/distro.h"
#include "doppel/ros/messages/message.h"

namespace doppel {

enum class FieldKind : std::uint8_t {
  boolean,
  byte,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  character,       // one byte; char of IDL, because char of a .msg file is uint8
  wide_character,  // UTF-16
  text,
  wide_text,  // UTF-16; here and in all text forms UTF-8
  message
};
enum class FieldShape : std::uint8_t { single, sequence, array };

DOPPEL_API std::string_view to_string(FieldKind kind);  // "float64", as .msg files have it; "" for a message
DOPPEL_API std::size_t least_cdr_size(
    FieldKind kind);  // bytes on the wire at least, without alignment; 0 for a message

struct TypeDescription;

struct DOPPEL_API FieldDescription {
  std::string name;
  FieldKind kind = FieldKind::boolean;
  FieldShape shape = FieldShape::single;
  std::size_t count = 1;                  // of an array's elements
  std::size_t bound = 0;                  // of a sequence's elements; 0: none
  std::size_t text_bound = 0;             // of each text; 0: none
  const TypeDescription* type = nullptr;  // of a message
  double initial = 0;                     // default of a single number that the sender omits

  [[nodiscard]] std::size_t least_element_size() const;
};

DOPPEL_API std::string to_string(
    const FieldDescription& field);  // its type: "string<=5[<=2]", "std_msgs/Header"

struct ConstantDescription {
  std::string name;
  FieldKind kind = FieldKind::int32;
  std::int64_t value = 0;
  std::string text;  // of a text
};
DOPPEL_API std::string to_string(const ConstantDescription& constant);  // "uint8 BLUE=3"

struct DOPPEL_API TypeDescription {
  std::string name;  // "sensor_msgs/msg/JointState"
  std::vector<FieldDescription> fields;
  std::vector<ConstantDescription> constants;
  std::size_t least_cdr_size = 1;  // one byte for a message without fields

  void add(FieldDescription field);
};

template <Message M>
const TypeDescription& describe(Distro distro = ros_distro());
DOPPEL_API const TypeDescription& description_of(const TypeSupport& type, Distro distro);

// Receives a message's values in order.
class DOPPEL_API ValueSink {
 public:
  virtual ~ValueSink() = default;
  virtual void begin_message(const TypeDescription& type) = 0;
  virtual void field(const FieldDescription& field) = 0;  // its value follows
  virtual void end_message() = 0;
  virtual void begin_list(std::size_t size) = 0;
  virtual void end_list() = 0;
  virtual void boolean(bool value) = 0;
  virtual void integer(std::int64_t value) = 0;
  virtual void natural(std::uint64_t value) = 0;
  virtual void real(double value) = 0;
  virtual void text(std::string_view value) = 0;
};

// Refuses what from_cdr refuses; the sink may then have received a part of the message.
DOPPEL_API Status walk_cdr(const TypeDescription& type, std::span<const std::byte> cdr, ValueSink& sink);

// The functions of TypeSupport for any described type.
DOPPEL_API std::string definition_text(const TypeDescription& type);  // its lines of a .msg file
DOPPEL_API std::string schema_text(const TypeDescription& type);
DOPPEL_API Status yaml_to_cdr(const TypeDescription& type, std::string_view yaml,
                              std::vector<std::byte>& out);
DOPPEL_API Status json_to_cdr(const TypeDescription& type, std::string_view json,
                              std::vector<std::byte>& out);
DOPPEL_API Status cdr_to_yaml(const TypeDescription& type, std::span<const std::byte> cdr, std::string& out);
DOPPEL_API Status cdr_to_json(const TypeDescription& type, std::span<const std::byte> cdr, std::string& out);
// Checked, little endian, without padding.
DOPPEL_API Status recode_cdr(const TypeDescription& type, std::span<const std::byte> cdr,
                             std::vector<std::byte>& out);

// The shortest decimal that reads back as the same double, spelled as Python's repr: "1.0",
// "1e-05", "inf", "nan".
DOPPEL_API std::string shortest_decimal(double value);

}  // namespace doppel

#include "doppel/ros/messages/detail/type_description.h"
