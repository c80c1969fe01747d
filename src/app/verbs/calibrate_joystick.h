#pragma once
// `doppel teleop joy --calibrate`: the user moves each axis and presses each button, and the file of parameters follows.

#include <filesystem>

#include "doppel/ros/teleop/joy_settings.h"

namespace doppel::app {

class Joystick;

// The user's file: ~/.config/doppel/joy.yaml.
std::filesystem::path own_joy_file();
// Asks on the terminal for the axes and buttons. Throws ClientError if nothing is moved, or it is unplugged.
JoySettings calibrate_joystick(Joystick& joystick, JoySettings settings);

}  // namespace doppel::app
