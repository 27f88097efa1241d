// Who somebody is to this page: by the name of the account, or, where there are no accounts, by where the act came from.

import { PAGE } from "./api.js";
import { known } from "./store.js";

const SCENE = "scene"; // what acts in the scene's frame name as their page
export const LOCAL = "local"; // everybody on a server without accounts

export const isThisPage = (who) => who.page === PAGE;

export function whoIs(who) {
  if (isThisPage(who)) return "This page";
  const where = who.page === SCENE ? "in the scene" : "on another page";
  if (who.name !== LOCAL) return known.me?.name === who.name ? `${who.name}, ${where}` : who.name;
  if (who.page === SCENE) return "Somebody in the scene";
  return who.page ? "Another page" : "A program";
}
