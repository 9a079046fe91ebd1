// The compiled core is taken in by address only; see vite.config.ts.
declare module "@core/*?url" {
  const url: string;
  export default url;
}
