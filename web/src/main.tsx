import "@fontsource-variable/inter/wght.css";
import "./ui/style.css";
import { render } from "preact";
import { followAddress } from "./state/route";
import { App } from "./ui/app";

followAddress();
render(<App />, document.getElementById("app")!);
