// Who somebody is to this page: by the name of the account, or, where there are no accounts, by where the act came from.

import { PAGE } from "./api.js";
import { known } from "./store.js";
import * as texts from "./texts/conn.js";

const SCENE = "scene"; // what acts in the scene's frame name as their page
export const LOCAL = "local"; // everybody on a server without accounts

export const isThisPage = (who) => who.page === PAGE;

export function whoIs(who) {
  if (isThisPage(who)) return texts.ThisPage;
  const where = who.page === SCENE ? texts.inTheScene : texts.onAnotherPage;
  if (who.name !== LOCAL) return known.me?.name === who.name ? `${who.name}, ${where}` : who.name;
  if (who.page === SCENE) return texts.somebodyInTheScene;
  return who.page ? texts.AnotherPage : texts.AProgram;
}
