// Shapes that printed parts are made of. Profiles are two-dimensional; `slab` and `plate_x` give them thickness.

// A slab of a convex profile with bevelled rims, from z = 0 to h.
module slab(h, bevel = 1) {
  hull() {
    linear_extrude(h) offset(delta = -bevel) children();
    translate([0, 0, bevel]) linear_extrude(h - 2 * bevel) children();
  }
}

// The profile's x becomes world y, its y becomes z; thickness along x from x0 to x1.
module along_x(x0, x1) {
  translate([x0, 0, 0]) rotate([90, 0, 90]) linear_extrude(x1 - x0) children();
}
module slab_x(x0, x1, bevel = 1) {
  translate([x0, 0, 0]) rotate([90, 0, 90]) slab(x1 - x0, bevel) children();
}
// The profile's x stays x, its y becomes z; thickness along y from y0 to y1.
module along_y(y0, y1) {
  translate([0, y1, 0]) rotate([90, 0, 0]) linear_extrude(y1 - y0) children();
}
module slab_y(y0, y1, bevel = 1) {
  translate([0, y1, 0]) rotate([90, 0, 0]) slab(y1 - y0, bevel) children();
}

module rounded(size, r) { offset(r) offset(delta = -r) square(size, center = true); }
module pill(a, b, r1, r2) { hull() { translate(a) circle(r1); translate(b) circle(r2); } }
module ring_of(n, r, start = 0) { for (i = [0:n - 1]) rotate(start + 360 * i / n) translate([r, 0]) children(); }
// Fillets every inner corner of a profile.
module filleted(r) { offset(-r) offset(delta = r) children(); }
