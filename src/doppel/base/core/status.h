#pragma once
// The result of an operation that may be refused in normal use: ok, or a sentence with the reason
// for the caller.

#include <string>
#include <utility>

namespace doppel {

class [[nodiscard]] Status {
 public:
  Status() = default;
  static Status refused(std::string why) {
    Status s;
    s.ok_ = false;
    s.why_ = std::move(why);
    return s;
  }

  [[nodiscard]] bool ok() const { return ok_; }
  explicit operator bool() const { return ok_; }
  [[nodiscard]] const std::string& why() const { return why_; }

 private:
  bool ok_ = true;
  std::string why_;
};

}  // namespace doppel
