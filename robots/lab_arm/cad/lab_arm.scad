// The lab's arm: five AX-12A servos, bent aluminium frames, printed housings. Millimetres; every part stands in its own
// link's frame, with the arm upright when all joints are at zero. `part` picks what is built; robots/build_meshes asks for
// each in turn. The names of the links are the lab's ("dyn" a servo, "f" a frame, "crawer" a finger).
use <../../cad_library/servos.scad>
use <../../cad_library/shapes.scad>

part = "";
$fn = 20;

base_height = 45;     // base_1_2
frame_y = 20.5;       // from a servo's middle to its horn's and its idler's outer face
frame_z = 24;         // from a servo's axis to its frame's floor
upper_arm = 135;      // j1 to j2
forearm = 80;         // j2 to j3
hand = 70;            // j3 to the wrist's horn
servo_low = 38.5;     // from a servo's axis to its lower end

// --- base --------------------------------------------------------------------------------------------------------------
module base_link() {
  difference() {
    union() {
      slab(5, 0.8) hull() ring_of(3, 52, 30) circle(22);
      translate([0, 0, 4]) cylinder(r1 = 56, r2 = 51, h = 30, $fn = 32);
      translate([0, 0, 33.9]) cylinder(r1 = 51, r2 = 47, h = 11.1, $fn = 32);
      hull() {                                                                        // shelf of the camera
        translate([0, 50, 26]) linear_extrude(4) square([34, 10], center = true);
        translate([0, 66, 26]) linear_extrude(4) rounded([34, 24], 4);
        translate([0, 52, 10]) linear_extrude(2) square([30, 4], center = true);
      }
    }
    translate([-13.5, 0, 6]) linear_extrude(60) square([51, 32.6], center = true);      // servo
    for (s = [-1, 1]) translate([0, 30 * s, 6]) linear_extrude(60) rounded([44, 20], 6);
    translate([28, 0, 6]) linear_extrude(60) rounded([16, 36], 5);
    translate([-52, 0, 14]) rotate([0, -90, 0]) linear_extrude(12, center = true) rounded([8, 16], 2, $fn = 8);  // bus
    ring_of_cut(3, 64, 30);
  }
}
module ring_of_cut(n, r, start) {
  for (i = [0:n - 1]) rotate(start + 360 * i / n) translate([r, 0, -1]) { cylinder(d = 4.5, h = 8, $fn = 12); translate([0, 0, 4]) cylinder(d = 8.5, h = 6, $fn = 16); }
}
module base_2() {  // lid with the bearing's race
  difference() {
    union() { slab(3, 0.6) circle(47, $fn = 32); cylinder(r = 40, h = 4.7, $fn = 32); }
    translate([0, 0, -1]) cylinder(r = 15, h = 8);
    for (i = [0:5]) rotate(60 * i) translate([43.5, 0, -1]) cylinder(d = 3.2, h = 8, $fn = 10);
    translate([0, 0, 3.4]) difference() { cylinder(r = 36, h = 3, $fn = 32); cylinder(r = 31, h = 3, $fn = 32); }
  }
}
module base_turn() {  // turntable with the cradle of the shoulder's servo
  difference() {
    union() {
      slab(5, 1) circle(42, $fn = 32);
      hull() {
        translate([0, 0, 4]) linear_extrude(1) rounded([52, 56], 10);
        translate([0, 0, 34]) linear_extrude(1) rounded([38, 41], 4);
      }
    }
    translate([0, 0, 55 - servo_low]) linear_extrude(60) square([32.4, 36.4], center = true);
    translate([0, 0, 55 - servo_low]) linear_extrude(60) translate([0, 8]) square([23, 36.4], center = true);
    translate([0, 0, -1]) cylinder(r = 11.3, h = 3.4);
    along_x(-40, 40) hull() { translate([-10, 12]) circle(2.5); translate([10, 12]) circle(2.5); translate([0, 8.5]) circle(1.5); }
    along_y(-40, 40) hull() { translate([-9, 12]) circle(2.5); translate([9, 12]) circle(2.5); translate([0, 8.5]) circle(1.5); }
    for (i = [0:5]) rotate(60 * i) translate([37, 0, 3.6]) cylinder(d = 4.2, h = 4, $fn = 8);
  }
}

// --- frames -------------------------------------------------------------------------------------------------------------
module frame_cheek() {
  difference() {
    hull() { circle(11.5); translate([-13, frame_z - 6]) square([26, 8]); }
    circle(d = 7);
    for (a = [0:90:270]) rotate(a) translate([8, 0]) circle(d = 2.4, $fn = 8);
    translate([0, 17]) rounded([14, 4], 1.9, $fn = 12);
  }
}
module frame_u() {  // 2 mm of aluminium, bent to a U round a servo
  along_y(frame_y, frame_y + 2) frame_cheek();
  along_y(-frame_y - 2, -frame_y) frame_cheek();
  difference() {
    translate([0, 0, frame_z]) linear_extrude(2) square([26, 2 * frame_y + 2], center = true);
    for (s = [-1, 0, 1]) translate([0, 13 * s, frame_z - 1]) cylinder(d = s == 0 ? 9 : 5, h = 4, $fn = 16);
  }
}

// --- housings: each stands on a frame and holds the next servo ------------------------------------------------------------
module socket(floor_z, axis_z) {
  low = axis_z - servo_low;
  difference() {
    union() {
      hull() {
        translate([0, 0, floor_z]) linear_extrude(1) rounded([26, 40], 4);
        translate([0, 0, low - 3]) linear_extrude(1) rounded([38, 42], 4);
      }
      translate([0, 0, low - 3]) linear_extrude(18) rounded([38, 42], 4);
    }
    translate([0, 0, low]) linear_extrude(40) square([32.4, 36.6], center = true);
    children();
  }
}
module f4() {
  socket(frame_z + 2, upper_arm) {
    translate([0, 0, frame_z + 6]) hull() {                                              // hollow
      linear_extrude(1) rounded([19, 32], 3);
      translate([0, 0, 58]) linear_extrude(1) rounded([28, 34], 3);
    }
    for (z = [40, 60, 79]) {
      along_x(-40, 40) hull() { for (s = [-1, 1]) translate([11 * s, z - 4]) circle(2.5, $fn = 6); translate([0, z + 6]) circle(2, $fn = 6); }
      along_y(-40, 40) hull() { for (s = [-1, 1]) translate([(5 + z / 25) * s, z - 4]) circle(2.5, $fn = 6); translate([0, z + 6]) circle(2, $fn = 6); }
    }
    along_x(-40, 40) hull() for (s = [-1, 1]) translate([9 * s, 104]) circle(3);
  }
}
module f5() {
  socket(frame_z + 2, forearm) {
    translate([0, 0, 20]) cylinder(d = 9, h = 30, $fn = 16);
    along_x(-40, 40) hull() for (s = [-1, 1]) translate([8 * s, 32]) circle(2.5);
    along_x(-40, 40) hull() for (s = [-1, 1]) translate([9 * s, 49]) circle(3);
  }
}
module wrist() {
  difference() {
    hull() {
      translate([0, 0, frame_z + 2]) linear_extrude(1) rounded([26, 40], 4);
      translate([-13.5, 0, frame_z + 9]) linear_extrude(1) rounded([56, 39], 4);
      translate([-13.5, 0, 48]) linear_extrude(1) rounded([56, 39], 4);
    }
    translate([-13.5, 0, 30]) linear_extrude(30) square([50.6, 32.6], center = true);
    translate([0, 0, 20]) cylinder(d = 12, h = 20);
    along_x(-60, 40) hull() for (s = [-1, 1]) translate([8 * s, 40]) circle(3);
    along_y(-40, 40) for (x = [-30, -13.5, 3]) hull() for (s = [-1, 1]) translate([x + 2.5 * s, 40]) circle(3);
  }
}

// --- gripper --------------------------------------------------------------------------------------------------------------
module crawer_base() {
  difference() {
    union() {
      slab(3.4, 0.5) circle(12);
      hull() {
        translate([0, 0, 3]) linear_extrude(1) rounded([18, 40], 4);
        translate([0, 0, 6]) linear_extrude(5) rounded([20, 58], 4);
      }
    }
    translate([0, 0, 8]) linear_extrude(4) rounded([9, 50], 1.5, $fn = 8);                // rail
    for (s = [-1, 1]) along_x(-20, 20) translate([19 * s, 7]) circle(d = 3.2, $fn = 10);
    along_x(-20, 20) translate([0, 6.6]) rounded([16, 3], 1.4, $fn = 8);
  }
}
module crawer(side) {  // side +1: left
  difference() {
    union() {
      translate([0, 0, -1.8]) linear_extrude(2) square([8.6, 11], center = true);         // slides in the rail
      along_x(-8, 8) scale([side, 1]) difference() {
        hull() { translate([-6.5, 1]) square([13, 2]); translate([-6.5, 16]) square([9, 1]); }
        translate([1, 7]) circle(2.4);
      }
      along_x(-8, 8) scale([side, 1]) difference() {
        hull() { translate([-6.5, 14]) square([9, 2]); translate([-6.5, 44]) square([3, 1]); translate([0.5, 26]) circle(2); }
        for (z = [20:4:42]) translate([-6.5, z]) rotate(45) square(1.6, center = true);
      }
    }
    along_y(-20, 20) hull() { translate([0, 20]) circle(2.5); translate([0, 34]) circle(2); }
  }
}

if (part == "base_link") base_link();
if (part == "base_2") base_2();
if (part == "base_turn") base_turn();
if (part == "f4") f4();
if (part == "f5") f5();
if (part == "wrist") wrist();
if (part == "crawer_base") crawer_base();
if (part == "crawer_left") crawer(1);
if (part == "crawer_right") crawer(-1);
if (part == "frame_u") frame_u();
if (part == "ax12_body") ax12_body();
if (part == "ax12_horn") ax12_horn();
