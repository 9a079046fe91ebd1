// A small line chart on a canvas: thrust over depth (which goes back and forth, so no sorted-x plotter serves).
import { useEffect, useRef } from "preact/hooks";

export interface Series {
  /** Pairs x, y; a live chart appends to it between draws. */
  points: number[];
}

interface ChartProps {
  series: Series;
  /** Redraw when this changes. */
  version: number;
  x: { name: string; unit: string; low: number; high: number };
  y: { name: string; unit: string; least_high: number };
  /** Upright lines with a word, e.g. the target's depth. */
  rules?: { at: number; name: string; colour: string }[];
  cursor?: [number, number] | null;
  label: string;
}

const kMargin = { left: 34, right: 10, top: 24, bottom: 22 };

export function Chart(props: ChartProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    drawChart(canvas.current!, props);
  }, [props.version, props.x.low, props.x.high, props.cursor?.[0], props.cursor?.[1]]);
  return <canvas ref={canvas} class="chart" role="img" aria-label={props.label} />;
}

function drawChart(canvas: HTMLCanvasElement, { series, x, y, rules, cursor }: ChartProps): void {
  const ratio = Math.min(devicePixelRatio, 2);
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  if (width === 0 || height === 0) return;
  if (canvas.width !== width * ratio || canvas.height !== height * ratio) {
    canvas.width = width * ratio;
    canvas.height = height * ratio;
  }
  const g = canvas.getContext("2d")!;
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, width, height);
  const most = Math.max(y.least_high, largestY(series.points));
  const tick = niceStep(most / 4);
  const high = Math.ceil(most / tick - 1e-9) * tick;
  const px = (v: number): number =>
    kMargin.left + ((v - x.low) / (x.high - x.low)) * (width - kMargin.left - kMargin.right);
  const py = (v: number): number =>
    height - kMargin.bottom - (v / high) * (height - kMargin.top - kMargin.bottom);
  drawGrid(g, x, y, { tick, high }, px, py, width);
  for (const rule of rules ?? []) drawRule(g, rule, px(rule.at), height);
  drawLine(g, series.points, px, py);
  if (cursor && cursor[0] >= x.low && cursor[0] <= x.high)
    drawCursor(g, px(cursor[0]), py(cursor[1]), height);
}

function drawGrid(
  g: CanvasRenderingContext2D,
  x: ChartProps["x"],
  y: ChartProps["y"],
  { tick, high }: { tick: number; high: number },
  px: (v: number) => number,
  py: (v: number) => number,
  width: number,
): void {
  g.font = "11px 'Inter Variable', system-ui, sans-serif";
  g.lineWidth = 1;
  g.textBaseline = "middle";
  g.textAlign = "right";
  for (let v = 0; v <= high * (1 + 1e-9); v += tick) {
    const at = Math.round(py(v)) + 0.5;
    g.strokeStyle = v === 0 ? "#3b4854" : "#222c35";
    g.beginPath();
    g.moveTo(kMargin.left, at);
    g.lineTo(width - kMargin.right, at);
    g.stroke();
    g.fillStyle = "#9aa7b3";
    g.fillText(String(Math.round(v * 100) / 100), kMargin.left - 6, at);
  }
  g.textBaseline = "alphabetic";
  g.textAlign = "center";
  const step = niceStep((x.high - x.low) / 5);
  for (let v = Math.ceil(x.low / step) * step; v <= x.high + 1e-9; v += step) {
    g.fillText(String(Math.round(v * 1000) / 1000), px(v), py(0) + 14);
  }
  g.textAlign = "left";
  g.fillText(`${y.name}, ${y.unit}, over ${x.name}, ${x.unit}`, kMargin.left, 11);
}

function drawRule(
  g: CanvasRenderingContext2D,
  rule: { name: string; colour: string },
  at: number,
  height: number,
): void {
  g.strokeStyle = rule.colour;
  g.setLineDash([3, 3]);
  g.beginPath();
  g.moveTo(at, kMargin.top);
  g.lineTo(at, height - kMargin.bottom);
  g.stroke();
  g.setLineDash([]);
}

function drawLine(
  g: CanvasRenderingContext2D,
  points: number[],
  px: (v: number) => number,
  py: (v: number) => number,
): void {
  g.strokeStyle = "#35c3d6";
  g.lineWidth = 1.5;
  g.lineJoin = "round";
  g.save();
  g.beginPath();
  g.rect(kMargin.left, 0, g.canvas.clientWidth - kMargin.left - kMargin.right, g.canvas.clientHeight);
  g.clip();
  g.beginPath();
  for (let i = 0; i + 1 < points.length; i += 2) g.lineTo(px(points[i]!), py(points[i + 1]!));
  g.stroke();
  g.restore();
}

function drawCursor(g: CanvasRenderingContext2D, x: number, y: number, height: number): void {
  g.strokeStyle = "rgba(255,255,255,.35)";
  g.lineWidth = 1;
  g.beginPath();
  g.moveTo(x, kMargin.top);
  g.lineTo(x, height - kMargin.bottom);
  g.stroke();
  g.fillStyle = "#f4f7fa";
  g.beginPath();
  g.arc(x, y, 3.5, 0, 2 * Math.PI);
  g.fill();
}

function largestY(points: number[]): number {
  let largest = 0;
  for (let i = 1; i < points.length; i += 2) largest = Math.max(largest, points[i]!);
  return largest;
}

/** 1, 2 or 5 times a power of ten, at least v. */
export function niceStep(v: number): number {
  const power = 10 ** Math.floor(Math.log10(v));
  return ([1, 2, 5, 10].find((m) => m * power >= v * (1 - 1e-9)) ?? 10) * power;
}
