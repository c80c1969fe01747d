#pragma once
// The facts that `doppel doctor` looks at: gathered by gather_facts(), judged by findings.h.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "doppel/devices/serial/serial_ports.h"
#include "doppel/export.h"

namespace doppel::doctor {

struct ProgramFacts {
  std::string version;
  std::filesystem::path page_folder;
  bool page_is_built = false;
  struct Engine {
    std::string name, package;  // "bullet", "libbullet-dev"
    bool is_default = false, is_built = false;
    std::string failure;  // why its module does not load; empty: it does
  };
  std::vector<Engine> engines;
};

struct ProcessorFacts {
  int cores = 0, usable_cores = 0;  // of the machine; those that this process may run on
  double load = 0;                  // of the last minute, in processes; negative: unknown
  std::string kernel, governor;     // "6.1.0-18-amd64", "powersave"; empty: unknown
  bool has_preempt_rt = false;
  std::string scheduling_failure;                    // why a thread cannot have SCHED_FIFO; empty: it can
  std::int64_t rtprio_limit = 0, memlock_limit = 0;  // -1: unlimited; bytes
};

struct DisplayFacts {
  bool has_display = false, is_ssh = false, has_terminal = false, is_wsl = false;
  bool has_xdg_open = false;
  std::vector<std::string> browsers;                // programs in PATH
  std::vector<std::string> render_nodes;            // of /dev/dri, and their like
  std::vector<std::string> forbidden_render_nodes;  // those that this user may not open
};

struct InterfaceFacts {
  std::string name, address;  // IPv4
  bool is_loopback = false, is_up = false, has_multicast_flag = false;
  std::string multicast_failure;  // why a datagram to the discovery group did not come back; empty: it did
};

struct NetworkFacts {
  std::vector<InterfaceFacts> interfaces;
  std::map<std::string, std::string> environment;  // ROS_* and RMW_* that are set
  unsigned domain = 0;
  std::string range;                 // "localhost", "subnet", "off", "system default"
  std::string environment_failure;   // why ROS 2's variables are refused; empty: they are not
  std::vector<std::string> remarks;  // on variables that are deprecated or ignored
  std::string participant_failure;   // why a participant cannot be made; empty: it can, or range is off
  std::string fast_dds;              // its version; empty: its module is missing
  int taken_participants = 0;        // of the domain's ports on this machine, from the first on
  struct TakenPort {
    int port = 0;
    std::string holder;
  };
  std::vector<TakenPort> taken_page_ports;  // of 8700 to 8720
};

struct StorageFacts {
  struct Place {
    std::string name, use;  // "temporary", "temporary files"
    std::filesystem::path path;
    bool exists = false, is_writable = false;
    std::int64_t free_bytes = -1, free_files = -1;  // -1: unknown
  };
  std::vector<Place> places;
  std::int64_t file_watches = -1, watch_instances = -1;  // limits of inotify; -1: unknown
  std::string watch_failure;                             // why a folder cannot be watched; empty: it can
  std::int64_t open_files = -1;
};

struct SerialFacts {
  struct Port {
    PortInfo info;
    std::string group;     // that may open it; empty: unknown
    bool permits = false;  // this user may open it
  };
  std::vector<Port> ports;         // on USB
  bool has_modem_manager = false;  // it runs, and tries new ports
};

struct Machine {
  ProgramFacts program;
  ProcessorFacts processor;
  DisplayFacts display;
  NetworkFacts network;
  StorageFacts storage;
  SerialFacts serial;
};

inline constexpr int kFirstPagePort = 8700, kLastPagePort = 8720;
inline constexpr int kMaxDomainParticipants = 120;

struct ProgramPlace {
  std::string version;
  std::filesystem::path root, page_folder;
};

// Looks at this machine; never throws for what is missing there. Takes up to two seconds.
DOPPEL_API Machine gather_facts(const ProgramPlace& program);

}  // namespace doppel::doctor
