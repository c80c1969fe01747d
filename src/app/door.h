#pragma once
// How people and programs get to what runs: the server with the page, its options on the command line, the
// announcement for other shells, and the browser that opens by itself on a desktop.

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <thread>

#include "doppel/server/announcement.h"
#include "doppel/server/server.h"

namespace doppel::app {

struct DoorOptions {
  int port = 0;  // 0: 8700 or the next that is free
  std::string host = "127.0.0.1", token;
  bool no_open = false;
};

// --port, --host, --token and --no-open.
void add_door_options(CLI::App& verb, DoorOptions& options);

class Door {
 public:
  // Listens and is announced when it returns. Throws InputError. `bus` and `log` have to outlive it.
  Door(Bus& bus, const std::string& robot, const DoorOptions& options, std::shared_ptr<AssetLibrary> assets,
       const Log& log);
  ~Door();

  // The banner's lines about where it is, to stderr.
  void print() const;
  // Opens the page in the desktop's browser, unless nobody sits in front of one or it was not wanted. Does
  // not wait for it.
  void open_page();

 private:
  const Log& log_;
  bool open_;
  Server server_;
  Announcement announcement_;
  std::thread opener_;
};

}  // namespace doppel::app
