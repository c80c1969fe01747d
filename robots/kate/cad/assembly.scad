// All parts in place: open it to look at the whole robot.
include <kate.scad>

color("#a01818") p3_body();
color("#181818") p3_deck();
color("#202020") p3_sonar_band();
color("#b8963c") p3_sonars();
for (s = [-1, 1]) translate([0, 165 * s, 0]) { color("#151515") p3_tyre(); color("#c8c8c8") p3_rim(); }
translate([-185, 0, 0]) color("#303030") p3_fork();
translate([-211, 0, -60]) color("#303030") p3_caster();
translate([21, 0, 136.5]) { color("#3a4f8f") lidar_body(); color("#101010") lidar_window(); }
translate([-140, 0, 136.5]) {
  color("#d8d8d4") katana_base();
  translate([0, 0, 201.5]) {
    color("#d8d8d4") katana_pan();
    rotate([0, -60, 0]) {
      color("#c23a2a") katana_upper();
      translate([190, 0, 0]) rotate([0, 100, 0]) {
        color("#d8d8d4") katana_fore();
        translate([139, 0, 0]) rotate([0, 20, 0]) {
          color("#d8d8d4") katana_wrist();
          translate([147.3, 0, 0]) {
            color("#8a8a8a") katana_roll();
            translate([150.5, 0, 0]) {
              color("#303030") katana_gripper();
              for (s = [0, 1]) mirror([0, s, 0]) translate([0, 20, 0]) rotate(0) { color("#505050") katana_finger(); color("#c0a040") katana_pad(); }
            }
          }
        }
      }
    }
  }
}
