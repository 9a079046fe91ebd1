// Small pieces that several rooms share.
import type { ComponentChildren } from "preact";
import type { Vec3 } from "../contract/bodies";
import { addressOf } from "../state/route";

export function Brand() {
  return (
    <a class="brand" href="#/" aria-label="SpinalTap, all cases">
      <svg viewBox="0 0 32 32" width="26" height="26" aria-hidden="true">
        <path
          d="M6 9c5-3.4 15-3.4 20 0 1.2 4.6 1.2 9.4 0 14-5 3.4-15 3.4-20 0-1.2-4.6-1.2-9.4 0-14z"
          fill="none"
          stroke="#d9cbb0"
          stroke-width="2"
        />
        <path d="M28.5 2.5 15.8 16.2" stroke="#35c3d6" stroke-width="2.8" stroke-linecap="round" />
        <circle cx="15.2" cy="16.9" r="2" fill="#f2a541" />
      </svg>
      <span>SpinalTap</span>
    </a>
  );
}

export interface Crumb {
  text: string;
  href?: string;
}

export function TopBar({ crumbs, children }: { crumbs: Crumb[]; children?: ComponentChildren }) {
  return (
    <header class="topbar">
      <Brand />
      <nav aria-label="Where you are">
        <ol>
          {crumbs.map((crumb) => (
            <li key={crumb.text}>
              {crumb.href === undefined ? (
                <span aria-current="page">{crumb.text}</span>
              ) : (
                <a href={crumb.href}>{crumb.text}</a>
              )}
            </li>
          ))}
        </ol>
      </nav>
      <div class="topbar-end">{children}</div>
    </header>
  );
}

export function caseCrumbs(case_id: string, label: string, here: string | null): Crumb[] {
  const up: Crumb = { text: "Cases", href: "#/" };
  if (here === null) return [up, { text: label }];
  return [up, { text: label, href: addressOf({ room: "case", case_id, path_id: null }) }, { text: here }];
}

export function Failure({ title, message, retry }: { title: string; message: string; retry?: () => void }) {
  return (
    <div class="failure" role="alert">
      <h2>{title}</h2>
      <p>{message}</p>
      {retry && (
        <button type="button" onClick={retry}>
          Try again
        </button>
      )}
    </div>
  );
}

export function Waiting({ text }: { text: string }) {
  return (
    <div class="waiting" role="status">
      <span class="spinner" aria-hidden="true" />
      {text}
    </div>
  );
}

export function Reading({
  name,
  value,
  unit,
  hot,
}: {
  name: string;
  value: string;
  unit: string;
  hot?: boolean;
}) {
  return (
    <div class={hot ? "reading hot" : "reading"}>
      <dt>{name}</dt>
      <dd>
        <span class="number" data-reading={name}>
          {value}
        </span>
        <span class="unit">{unit}</span>
      </dd>
    </div>
  );
}

export function whenText(created: string): string {
  const date = new Date(created);
  if (Number.isNaN(date.getTime())) return created;
  return date.toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
}

/** "1 path", "2 paths". */
export function counted(count: number, noun: string): string {
  return `${count.toLocaleString("en")} ${noun}${count === 1 ? "" : "s"}`;
}

export function Fact({ name, value }: { name: string; value: string }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{value}</dd>
    </div>
  );
}

/** In the letters of the picture, not in signs. */
export function pointText([x, y, z]: Vec3): string {
  const one = (v: number, minus: string, plus: string): string =>
    `${v < 0 ? minus : plus} ${Math.abs(v).toFixed(1)}`;
  return `${one(x, "R", "L")}  ${one(y, "A", "P")}  ${one(z, "F", "H")} mm`;
}
