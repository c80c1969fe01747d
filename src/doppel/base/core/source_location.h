#pragma once
// The place of something in the user's source: file, line and column, with the macro calls and includes that
// led there. Every node of a description and every diagnostic has one.

#include <memory>
#include <string>

#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API SourceLocation {
  // One step of an expansion: the place that called or included, and what it called
  // ("in macro 'servo_joint'").
  struct Within;

  std::shared_ptr<const std::string> file;  // as the user named it; nullptr: unknown
  int line = 0;                             // 1-based; 0: unknown
  int column = 0;                           // 1-based; 0: unknown
  std::shared_ptr<const Within> within;     // the innermost expansion of this place; nullptr: none

  [[nodiscard]] bool known() const { return file != nullptr; }

  // "joints.xacro:14:3", without the expansions around it.
  [[nodiscard]] std::string place() const;

  // "arm.xacro:210:5: in macro 'servo_joint' (joints.xacro:14:3)": outermost call first, this place last.
  [[nodiscard]] std::string str() const;
};

struct SourceLocation::Within {
  SourceLocation call;  // where the macro was called or the file included
  std::string what;     // "in macro 'servo_joint'", "in include"
};

DOPPEL_API SourceLocation make_location(std::string file, int line = 0, int column = 0);

}  // namespace doppel
