// What the eye calls right and up, in the plane across the path.

type Flat = [number, number];

/**
 * @param right, up, away  the screen's axes, projected onto the plane; any of them may vanish there.
 * @return unit directions at right angles. Where the screen's up does not lie in the plane (looking at the path from
 * the side), up means away from the viewer; likewise right.
 */
export function screenAcross(right: Flat, up: Flat, away: Flat): { right: Flat; up: Flat } {
  const size = (v: Flat): number => Math.hypot(v[0], v[1]);
  const unit = (v: Flat): Flat => [v[0] / size(v), v[1] / size(v)];
  const along = (a: Flat, b: Flat): number => a[0] * b[0] + a[1] * b[1];
  /** At right angles to v, on the side of `towards`, or of `else_towards` when that does not decide. */
  const square = (v: Flat, towards: Flat, else_towards: Flat): Flat => {
    const turned: Flat = [-v[1], v[0]];
    const hint = Math.abs(along(turned, towards)) > 0.2 ? towards : else_towards;
    return along(turned, hint) < 0 ? [v[1], -v[0]] : turned;
  };
  if (size(right) >= size(up)) {
    const r = unit(right);
    return { right: r, up: square(r, up, away) };
  }
  const u = unit(up);
  return { right: square(u, right, away), up: u };
}
