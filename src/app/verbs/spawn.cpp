// doppel spawn and delete: adds and removes robots of a running twin.
#include "app/description_target.h"
#include "app/verbs/shell.h"
#include "app/verbs/verbs.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/scenario/resolve/open_target.h"
#include "doppel/scenario/schema/robot_text.h"
#include "doppel/sensors/rigs/pose_messages.h"

namespace doppel::app {
namespace {

constexpr std::chrono::seconds kSpawnTimeout{60};  // a robot with large meshes loads slowly

struct SpawnOptions {
  std::vector<std::string> words;  // TARGET and its name:=value
  std::string name, name_space, place = "0,0,0", base = "auto";
};

struct DeleteOptions {
  std::string name;
};

template <Service S>
int call_and_print(Client& twin, const std::string& service, const typename S::Request& request) {
  const auto answer = decode<typename S::Response>(call_raw(twin, service, to_cdr(request), kSpawnTimeout));
  if (!answer.success) throw ClientError(answer.status_message);
  print_line("{}\n", answer.status_message);
  return 0;
}

// The request has no field for the base, so the description carries it.
std::string with_base(std::string xml, const std::string& base) {
  const std::size_t end = xml.rfind("</robot>");
  if (base == "auto" || end == std::string::npos) return xml;
  return xml.insert(end, "<gazebo><doppel:base>" + base + "</doppel:base></gazebo>");
}

int spawn(Shell& shell, const SpawnOptions& options) {
  const geometry_msgs::msg::Pose place = to_pose_msg(parse_place(options.place, "--at"));
  DescriptionTarget target = open_target(options.words);
  Diagnostics chosen;
  target.arguments =
      simulation_arguments(target.target.description, std::move(target.arguments), target.resolver, chosen);
  print_diagnostics(chosen, true);
  const LoadedDescription loaded = load_target(target);
  using gazebo_msgs::srv::SpawnEntity;
  SpawnEntity::Request request;
  request.name = !options.name.empty()         ? options.name
                 : !options.name_space.empty() ? options.name_space
                                               : loaded.robot.name;
  request.robot_namespace = options.name_space.empty() ? request.name : options.name_space;
  request.xml = with_base(loaded.robot.xml, options.base);
  request.initial_pose = place;
  return call_and_print<SpawnEntity>(shell.twin(), "/spawn_entity", request);
}

int delete_entity(Shell& shell, const DeleteOptions& options) {
  using gazebo_msgs::srv::DeleteEntity;
  DeleteEntity::Request request;
  request.name = options.name;
  return call_and_print<DeleteEntity>(shell.twin(), "/delete_entity", request);
}

}  // namespace

void add_spawn(CLI::App& app, int& exit_code) {
  add_verb<SpawnOptions>(
      app, "spawn",
      "Spawn a robot with its controllers, or an object (a description without moving joints), in a running "
      "twin",
      "doppel spawn omarm_one --ns right --at 0.8,0,0,0,0,3.14159", exit_code,
      [](CLI::App& verb, SpawnOptions& options) {
        add_target(verb, options.words);
        verb.add_option("--ns", options.name_space,
                        "Namespace of a robot, also its name in the world (default: the name)");
        verb.add_option("--name", options.name,
                        "Name in the world (default: the namespace, or the name in the description)");
        verb.add_option(
                "--base", options.base,
                "fixed to the world, floating, or auto: an object with a mass floats, a robot as with up")
            ->check(CLI::IsMember({"auto", "fixed", "floating"}));
        verb.add_option("--at", options.place, "Pose of its root link: x,y,z[,roll,pitch,yaw], m and rad")
            ->capture_default_str();
      },
      spawn);
  add_verb<DeleteOptions>(
      app, "delete", "Delete a robot or an object from a running twin", "doppel delete right", exit_code,
      [](CLI::App& verb, DeleteOptions& options) {
        verb.add_option("name", options.name, "Namespace of the robot, or name of the object")->required();
      },
      delete_entity);
}

}  // namespace doppel::app
