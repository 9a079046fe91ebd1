import "@fontsource-variable/inter/wght.css";
import "./ui/style.css";
import { render } from "preact";
import { guardUnsaved } from "./state/plan_session";
import { followAddress } from "./state/route";
import { App } from "./ui/app";

followAddress();
guardUnsaved();
render(<App />, document.getElementById("app")!);
