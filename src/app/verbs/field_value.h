#pragma once
// One field of a message, by its path: "position", "header.stamp.sec", "transforms[0].child_frame_id".

#include <span>
#include <string>
#include <string_view>

#include "doppel/ros/messages/type_description.h"

namespace doppel::app {

// The field's value as YAML with a line's end: scalars and lists of scalars on one line, messages in block
// style. Refused: a field that the type does not have (with the nearest), an index outside the list.
Status field_as_yaml(const TypeDescription& type, std::span<const std::byte> cdr, std::string_view path,
                     std::string& out);
// Refuses a field that the type does not have, before there is any message.
Status check_field_path(const TypeDescription& type, std::string_view path);

// The format in which a message, or a field of it, is printed: by default as YAML in block style.
struct MessageFormat {
  std::string field;                           // its path; empty: the whole message
  bool csv = false;                            // all values on one line, separated by commas
  bool flow = false;                           // YAML on one line
  bool no_arrays = false, no_strings = false;  // their types and lengths instead
};
Status format_message(const TypeDescription& type, std::span<const std::byte> cdr,
                      const MessageFormat& format, std::string& out);

// The fields of a type as `ros2 interface show` lists them, nested ones indented.
std::string show_type(const TypeDescription& type);

}  // namespace doppel::app
