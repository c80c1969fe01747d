// Kate: a Pioneer 3-DX with a Katana arm, in millimetres, drawn by the sizes in urdf/. Each part is in the frame of its
// link: the base's in base_link (the middle of the axle, x forward), the arm's in the frame of the joint that moves it.
part = "";
$fn = 40;

// -- base

module hull_outline(inset = 0) {  // seen from above, about the axle
  offset(delta = -inset) polygon([
    [150, 70], [150, -70], [118, -118], [60, -137], [-90, -137], [-170, -128], [-222, -84],
    [-238, -30], [-238, 30], [-222, 84], [-170, 128], [-90, 137], [60, 137], [118, 118]]);
}

module p3_body() {
  difference() {
    union() {
      translate([0, 0, -38]) linear_extrude(4) hull_outline(10);
      translate([0, 0, -34]) linear_extrude(90) hull_outline(4);
      translate([0, 0, 56]) linear_extrude(6, scale = 0.985) hull_outline(4);
      translate([-40, 0, 62]) linear_extrude(66) square([310, 200], center = true);
    }
    for (s = [-1, 1]) {                                                // wheel wells and their arches
      translate([0, 137 * s, 0]) rotate([90, 0, 0]) cylinder(r = 106, h = 84, center = true, $fn = 60);
      translate([-185, 0, -60]) cylinder(r = 72, h = 42);
    }
    for (z = [-18, -4, 10]) translate([-30, 0, z]) difference() {      // grooves of the side panels
      linear_extrude(2.5) offset(5) hull_outline();
      translate([0, 0, -1]) linear_extrude(5) hull_outline(6);
    }
  }
}

module p3_deck() {
  translate([0, 0, 130.5]) {
    linear_extrude(4) hull_outline(-6);
    translate([0, 0, 4]) linear_extrude(2) difference() {
      hull_outline(-6);
      hull_outline(4);
    }
  }
}

// A row of sonars along the edge: the discs of their transducers, gold on a black band.
front_sonars = [[69, 136, 90], [114, 119, 50], [148, 78, 30], [166, 27, 10],
                [166, -27, -10], [148, -78, -30], [114, -119, -50], [69, -136, -90]];
rear_sonars = [[-157, -136, -90], [-203, -119, -130], [-237, -78, -150], [-255, -27, -170],
               [-255, 27, 170], [-237, 78, 150], [-203, 119, 130], [-157, 136, 90]];

module at_sonars(list) {
  for (s = list) translate([s.x, s.y, 103]) rotate(s.z) children();
}
module band(list) {
  for (i = [0:len(list) - 2]) hull() for (k = [i, i + 1])
    translate([list[k].x, list[k].y, 78]) rotate(list[k].z) translate([-8, 0, 0]) cylinder(r = 6, h = 50, $fn = 12);
}
module p3_sonar_band() {
  difference() {
    union() { band(front_sonars); band(rear_sonars); }
    at_sonars(concat(front_sonars, rear_sonars)) rotate([0, 90, 0]) cylinder(d = 37, h = 20, center = true, $fn = 24);
  }
  for (s = [-1, 1]) translate([-40, 112 * s, 78]) linear_extrude(50) square([230, 8], center = true);
}
module p3_sonars() {
  at_sonars(concat(front_sonars, rear_sonars)) rotate([0, 90, 0]) translate([0, 0, -7]) {
    cylinder(d = 36, h = 5, $fn = 24);
    difference() {
      cylinder(d = 38, h = 7, $fn = 24);
      translate([0, 0, 5]) cylinder(d = 33, h = 3, $fn = 24);
    }
  }
}

module p3_tyre() {  // axle along y
  rotate([90, 0, 0]) difference() {
    union() {
      rotate_extrude($fn = 72) polygon([[62, -22], [90, -24], [95.5, -18], [97.5, -8], [97.5, 8], [95.5, 18], [90, 24], [62, 22]]);
    }
    for (a = [0:10:350], s = [-1, 1]) rotate(a + 5 * (s + 1) / 2) translate([97.5, 0, 14 * s]) cube([3, 5, 14], center = true);
  }
}
module p3_rim() {
  rotate([90, 0, 0]) {
    difference() {
      cylinder(r = 63, h = 40, center = true, $fn = 60);
      for (s = [-1, 1]) translate([0, 0, 17 * s]) cylinder(r = 56, h = 22, center = true, $fn = 60);
    }
    for (a = [0:72:288]) rotate(a) translate([34, 0, 0]) cube([46, 16, 26], center = true);
    cylinder(r = 17, h = 46, center = true);
  }
}

module p3_fork() {  // in the frame of the swivel, at the height of the axle; the wheel trails behind
  translate([0, 0, -12]) cylinder(r = 17, h = 10);
  translate([0, 0, -20]) cylinder(r = 24, h = 8);
  for (s = [-1, 1]) hull() {
    translate([0, 15 * s, -22]) cube([34, 4, 4], center = true);
    translate([-26, 15 * s, -60]) rotate([90, 0, 0]) cylinder(r = 9, h = 4, center = true);
  }
}
module p3_caster() {
  rotate([90, 0, 0]) rotate_extrude() polygon([[0, -11], [26, -10], [35, -9], [37.5, -5], [37.5, 5], [35, 9], [26, 10], [0, 11]]);
}

module lidar_body() {  // a SICK LMS 200: 155 x 155 x 210
  difference() {
    translate([0, 0, 0]) union() {
      translate([-8, 0, 0]) linear_extrude(72) offset(6) square([125, 140], center = true);
      translate([-30, 0, 0]) linear_extrude(210) offset(6) square([76, 140], center = true);
      translate([-6, 0, 140]) linear_extrude(70) offset(8) square([128, 138], center = true);
    }
    for (s = [-1, 1]) translate([40, 78 * s, 100]) rotate([0, 30 * 0, 30 * s]) cube([80, 30, 60], center = true);
  }
}
module lidar_window() {
  translate([4, 0, 74]) cylinder(r = 60, h = 64);
}

// -- arm

module joint_drum(r, w) { rotate([90, 0, 0]) cylinder(r = r, h = w, center = true); }
module bolts(r, d, z) { for (a = [30:60:330]) rotate(a) translate([r, 0, z]) cylinder(d = d, h = 3, $fn = 10); }

module katana_base() {
  cylinder(r = 78, h = 10);
  bolts(68, 9, 9);
  translate([0, 0, 10]) cylinder(r1 = 66, r2 = 58, h = 70);
  translate([0, 0, 80]) cylinder(r = 58, h = 42);
  translate([-62, 0, 46]) cube([34, 58, 60], center = true);
}
module katana_pan() {  // its frame is at the axis of the shoulder
  translate([0, 0, -79.5]) cylinder(r = 56, h = 20);
  difference() {
    translate([0, 0, -60]) linear_extrude(60) offset(8) square([70, 92], center = true);
    translate([10, 0, -6]) cube([120, 62, 70], center = true);
  }
  for (s = [-1, 1]) translate([0, 46 * s, 0]) joint_drum(42, 16);
}
module lift_link(length, r1, r2, w) {
  joint_drum(r1, w);
  hull() {
    translate([12, 0, 0]) joint_drum(r1 - 8, w * 0.8);
    translate([length - 16, 0, 0]) joint_drum(r2 - 4, w * 0.7);
  }
  for (s = [-1, 1]) hull() {
    translate([length, (w / 2 + 4) * s, 0]) joint_drum(r2, 8);
    translate([length - 60, (w / 2 + 2) * s, 0]) joint_drum(r2 - 12, 6);
  }
  translate([length * 0.45, 0, r1 - 8]) rotate([0, 90, 0]) cylinder(r = 15, h = length * 0.42, center = true);
}
module katana_upper() { lift_link(190, 38, 34, 58); }
module katana_fore() { lift_link(139, 32, 28, 50); }
module katana_wrist() {
  joint_drum(27, 44);
  hull() {
    translate([14, 0, 0]) joint_drum(22, 38);
    translate([90, 0, 0]) rotate([0, 90, 0]) cylinder(r = 24, h = 4);
  }
  translate([90, 0, 0]) rotate([0, 90, 0]) cylinder(r = 27, h = 50);
}
module katana_roll() {
  rotate([0, 90, 0]) { cylinder(r = 25, h = 26); translate([0, 0, 26]) cylinder(r1 = 25, r2 = 20, h = 20); translate([0, 0, 46]) cylinder(r = 17, h = 60); }
  translate([112, 0, 0]) cube([14, 44, 40], center = true);
}
module katana_gripper() {  // at 150.5 before the roll's frame
  translate([-20, 0, 0]) cube([38, 62, 34], center = true);
  for (s = [-1, 1]) translate([0, 20 * s, 0]) cylinder(r = 10, h = 42, center = true);
}
// About its hinge; its pad is parallel to the other one where the hands hold 40 mm.
finger_bend = 16;
module katana_finger() {
  cylinder(r = 8, h = 30, center = true);
  hull() {
    cylinder(r = 7, h = 22, center = true);
    translate([42, 14, 0]) cylinder(r = 5, h = 20, center = true);
  }
  translate([42, 14, 0]) rotate(-finger_bend) hull() {
    cylinder(r = 5, h = 20, center = true);
    translate([62, 0, 0]) cylinder(r = 4, h = 16, center = true);
  }
}
module katana_pad() {
  translate([42, 14, 0]) rotate(-finger_bend) translate([38, -5.5, 0]) cube([48, 3, 15], center = true);
}
module camera_body() {
  cube([24, 58, 26], center = true);
  translate([12, 0, 0]) rotate([0, 90, 0]) difference() { cylinder(r = 10, h = 10); translate([0, 0, 7]) cylinder(r = 8, h = 4); }
}

if (part == "p3_body") p3_body();
if (part == "p3_deck") p3_deck();
if (part == "p3_sonar_band") p3_sonar_band();
if (part == "p3_sonars") p3_sonars();
if (part == "p3_tyre") p3_tyre();
if (part == "p3_rim") p3_rim();
if (part == "p3_fork") p3_fork();
if (part == "p3_caster") p3_caster();
if (part == "lidar_body") lidar_body();
if (part == "lidar_window") lidar_window();
if (part == "katana_base") katana_base();
if (part == "katana_pan") katana_pan();
if (part == "katana_upper") katana_upper();
if (part == "katana_fore") katana_fore();
if (part == "katana_wrist") katana_wrist();
if (part == "katana_roll") katana_roll();
if (part == "katana_gripper") katana_gripper();
if (part == "katana_finger") katana_finger();
if (part == "katana_pad") katana_pad();
if (part == "camera_body") camera_body();
