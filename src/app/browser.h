#pragma once
// Opens the page in the desktop's browser where the program is started from a desktop.

#include <string>
#include <thread>

#include "doppel/base/core/log.h"

namespace doppel::app {

class Browser {
 public:
  // `log` has to outlive it.
  explicit Browser(const Log& log) : log_(log) {}
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  // Once, and only from a terminal of this machine's desktop; does not wait for the browser.
  void open(const std::string& url);

 private:
  const Log& log_;
  std::thread opener_;
};

}  // namespace doppel::app
