// Hobby servos by their data sheets, in millimetres. Every servo has its origin in the middle of the outer face of its
// horn, the shaft along +z, the long side of the body along x with the shaft near the +x end.
// Bodies and horns are separate modules, so that a description can give them different colours.

// DS3240-180: body 40 x 20 x 39, ears 54, 25 teeth; 60 g with its horn.
ds3240_height = 46;  // horn face to the bottom

module box_with_bevel(size, bevel) {
  hull() {
    linear_extrude(size.z) square([size.x - 2 * bevel, size.y - 2 * bevel], center = true);
    translate([0, 0, bevel]) linear_extrude(size.z - 2 * bevel) square([size.x, size.y], center = true);
  }
}

module ds3240_body($fn = 24) {
  translate([-10, 0, -46]) {
    box_with_bevel([40, 20, 8.2], 0.8);                                              // bottom cover
    translate([0, 0, 8.2]) linear_extrude(0.8) square([39, 19], center = true);     // parting line
    translate([0, 0, 9]) linear_extrude(19) square([40, 20], center = true);        // middle case
    translate([0, 0, 28]) linear_extrude(0.8) square([39, 19], center = true);
    translate([0, 0, 28.8]) box_with_bevel([40, 20, 10.2], 0.8);                      // gear case
  }
  translate([-10, 0, -17]) linear_extrude(2.5) difference() {                         // ears
    offset(1) square([52, 18], center = true);
    for (x = [-24.5, 24.5], y = [-5, 5]) translate([x, y]) circle(d = 4.3, $fn = 12);
  }
  translate([0, 0, -7.01]) cylinder(d1 = 15, d2 = 12.5, h = 2.2);                      // boss around the shaft
  translate([-12, 0, -7.01]) cylinder(d = 7, h = 1.2);                                 // second gear's bearing
  for (x = [-28, 8], y = [-8, 8]) translate([x, y, -46.6]) cylinder(d = 3.6, h = 1, $fn = 8);  // case screws
  hull() for (x = [-30, -33]) translate([x, 0, -41]) rotate([0, 90, 0])                // strain relief
    cylinder(d1 = 7, d2 = 5.5, h = 1, $fn = 12);
}

module ds3240_cable($fn = 10) {
  for (y = [-1.6, 0, 1.6]) hull() {
    translate([-33, y, -41]) sphere(d = 1.6);
    translate([-39, y, -41]) sphere(d = 1.6);
  }
}

module ds3240_horn($fn = 32) {
  difference() {
    union() {
      translate([0, 0, -2.6]) cylinder(d = 20.5, h = 2.6);
      translate([0, 0, -5.6]) cylinder(d = 9, h = 3.2);
    }
    for (a = [45:90:315]) rotate(a) translate([7, 0, -3]) cylinder(d = 3, h = 4, $fn = 10);
    translate([0, 0, -1.2]) cylinder(d = 5.6, h = 2, $fn = 16);
  }
}

// SG90: body 22.8 x 12.2 x 22.7; 9 g.
module sg90_body($fn = 24) {
  translate([-5.5, 0, -29]) linear_extrude(22.7) offset(0.6) square([21.6, 11], center = true);
  translate([-5.5, 0, -13.1]) linear_extrude(2.4) difference() {
    square([32.4, 12.2], center = true);
    for (s = [-1, 1]) translate([14 * s, 0]) circle(d = 2.2, $fn = 10);
  }
  translate([0, 0, -6.4]) cylinder(d = 11.8, h = 4);
  translate([-6, 0, -6.4]) cylinder(d = 5.4, h = 4);
  translate([-17, 0, -26]) rotate([0, -90, 0]) linear_extrude(5) square([1.4, 3.6], center = true);  // cable
}

// MG996R: the same standard case as the DS3240; 55 g. MG90S: the SG90's case with metal gears; 13.4 g.

module small_horn($fn = 24) {
  translate([0, 0, -2]) linear_extrude(2) difference() {
    hull() { circle(d = 7.2); translate([14, 0]) circle(d = 4); }
    for (x = [7, 10.5, 14]) translate([x, 0]) circle(d = 1.2, $fn = 8);
  }
  translate([0, 0, -3.6]) cylinder(d = 6.6, h = 1.8);
}

// Dynamixel AX-12A: 32 x 50 x 40; 54.6 g. The idler's face is 41 mm behind the horn's.
module ax12_profile(w) {
  polygon([[-38.5, -w + 3], [-35.5, -w], [8, -w], [11.5, -w + 4], [11.5, w - 4], [8, w], [-35.5, w], [-38.5, w - 3]]);
}
module ax12_body($fn = 24) {
  difference() {
    union() {
      translate([0, 0, -40]) linear_extrude(6) ax12_profile(16);
      translate([0, 0, -34.01]) linear_extrude(22.02) ax12_profile(13.6);
      translate([0, 0, -12]) linear_extrude(8) ax12_profile(16);
      for (x = [-36, -20, 4]) translate([x - 1, -16, -35]) cube([2, 32, 24]);         // ribs between the covers
    }
    for (x = [-32, -24, -12, 5], s = [-1, 1]) translate([x, 13.2 * s, -45]) cylinder(d = 2.6, h = 50, $fn = 8);
    translate([-25, 0, -4.6]) linear_extrude(2) rounded_plate([16, 18], 2);             // label
  }
  translate([0, 0, -41]) cylinder(d = 11, h = 2);
  translate([-25, 0, -40.6]) linear_extrude(1) rounded_plate([9, 20], 1);               // sockets for the cables
}
module rounded_plate(size, r) { offset(r, $fn = 8) offset(delta = -r) square(size, center = true); }

module ax12_horn($fn = 32) {
  translate([0, 0, -4.2]) cylinder(d = 16, h = 2);
  difference() {
    translate([0, 0, -2.3]) cylinder(d = 22, h = 2.3);
    for (a = [0:45:315]) rotate(a) translate([8, 0, -1.5]) cylinder(d = 2.4, h = 3, $fn = 8);
    translate([0, 0, -1]) cylinder(d = 6, h = 2, $fn = 12);
  }
}
