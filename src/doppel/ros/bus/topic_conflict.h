#pragma once
// Thrown if a node asks for a topic that other nodes use with another type.

#include <stdexcept>
#include <string>
#include <utility>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API TopicConflict : public std::logic_error {
 public:
  TopicConflict(const std::string& text, std::string topic, std::string asked, std::string used)
      : std::logic_error(text), topic_(std::move(topic)), asked_(std::move(asked)), used_(std::move(used)) {}
  [[nodiscard]] const std::string& topic() const { return topic_; }
  [[nodiscard]] const std::string& asked() const { return asked_; }  // types
  [[nodiscard]] const std::string& used() const { return used_; }

 private:
  std::string topic_, asked_, used_;
};

}  // namespace doppel
