#pragma once
// The message types of definitions/*.msgs as data, for the writers of C++ and IDL. A file has the types of
// one ROS package, as text of .msg, .srv and .action files in fewer lines:
//
//   # What the package is for.
//
//   msg Image:
//     std_msgs/Header header; uint32 height, width  # pixels
//     string encoding "rgb8"
//   srv SetBool: bool data --- bool success; string message
//
// A type begins with its kind and name and ends before the next one; the lines below the first are indented.
// Between declarations is a semicolon or the end of the line; names with a comma between them have the same
// type. Types are defined above their use. A line `include FILE` adds a hand-written header at the end of the
// package's header. A declaration of fields that not all distributions of ROS 2 have begins with the first or
// the last one: `[from kilted] int32 index`, `[to jazzy] string class_type`.

#include <cstddef>
#include <deque>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/ros/messages/distro.h"

namespace doppel::message_generator {

struct BasicType {
  std::string_view name;  // in the definitions
  std::string_view kind;  // enumerator of FieldKind
  std::string_view cpp, idl;
  bool (*accepts)(std::string_view value);  // as a default or a constant
};

struct Type;

struct FieldType {
  const BasicType* basic = nullptr;
  const Type* message = nullptr;         // if basic is nullptr
  std::string_view shape = "single";     // enumerator of FieldShape
  std::size_t size = 0, text_bound = 0;  // of an array, or bounds; 0: none
};

struct Member {
  std::string name;
  std::string value;  // a default or constant as it is written; empty: none
};

struct Declaration {
  FieldType type;
  bool constant = false;
  DistroRange range;
  std::vector<Member> members;
  std::vector<std::string> comments;  // lines above it
  std::string comment;                // behind it
};

// A message, or a part of a service or an action.
struct Type {
  std::string package, kind, name;  // "std_srvs", "srv", "Trigger_Request"
  std::size_t index = 0;            // in Definitions::types
  std::vector<Declaration> declarations;

  [[nodiscard]] std::string full_name() const { return package + "/" + kind + "/" + name; }
};

struct Interface {
  std::string kind, name;
  std::vector<std::string> comments;
  std::vector<Type*> parts;  // one of a message, two of a service, three of an action
};

struct Package {
  std::string name;
  std::vector<std::string> comments;
  std::vector<std::string> includes;
  std::set<std::string> uses;  // other packages
  std::vector<Interface> interfaces;
};

struct Definitions {
  std::deque<Type> types;  // a type is behind those that it contains
  std::deque<Package> packages;
};

// Throws InputError with the place of the first error.
Definitions read_definitions(std::span<const std::filesystem::path> files);

// "_Request" for the first part of a service; "" for a message.
std::string_view part_suffix(std::string_view kind, std::size_t part);

// Files by name.
using Files = std::vector<std::pair<std::string, std::string>>;
Files cpp_files(const Definitions& definitions);
Files idl_files(const Definitions& definitions, Distro distro);

}  // namespace doppel::message_generator
